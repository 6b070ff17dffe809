"""The search of the effects: noise of the logs, screening, confirmation, a queue of hypotheses."""
