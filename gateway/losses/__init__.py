"""Parasitic losses of the bench: steady stretches of a run, fit of the friction law, result."""
