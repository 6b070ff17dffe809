"""The analysis of parasitic losses: steady sections, fit of the friction law."""
