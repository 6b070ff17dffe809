"""From a running bench to one that can be believed: programs, and what their runs show (pure)."""
