"""The gateway against a digital twin of its bench, in one virtual time."""
