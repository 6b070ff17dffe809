"""The replay of logs and recordings through the regulator, and its evaluation."""
