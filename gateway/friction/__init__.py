"""Friction of the bench as the regulator knows it: laws, their tables, and parameter sets."""
