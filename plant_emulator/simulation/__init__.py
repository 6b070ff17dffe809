"""Simulations with the model: logs, drive programs, a truck's travel cycle, the running bench."""
