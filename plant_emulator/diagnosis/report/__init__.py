"""The presentation of a diagnosis: the answer as JSON, the terminal, the HTML report."""
