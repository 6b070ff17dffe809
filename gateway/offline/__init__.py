"""Replay of logs and recordings through the tick, and the key figures of a run."""
