"""The review before a start: limits, bounds, loop stability, register map."""
