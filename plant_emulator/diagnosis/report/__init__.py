"""How a diagnosis is shown: the answer as JSON, the terminal, the HTML report."""
