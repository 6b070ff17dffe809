"""Review of a configuration before a start: limits, bounds, loop stability, register map."""
