"""The search of the effects: noise of the logs, confirmation, a queue of hypotheses."""
