"""The checks of the emulated road: one file each, from the steps of a run to values (pure)."""
