"""The blind trial as it runs: sealed folder, diagnosis in a process of its own, scoring."""
