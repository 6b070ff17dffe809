"""The noise of the channels as the answer and the report show it."""
