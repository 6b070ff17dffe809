"""Signals over time: the log record, the noise of its channels, smoothing."""
