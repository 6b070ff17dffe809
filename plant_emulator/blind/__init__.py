"""The blind trial: it hides effects, lets `diagnose` see only logs, unseals and scores."""
