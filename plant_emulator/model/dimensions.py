"""Dimensions of truck and bench that truck models and commands take where none are given.

A parameter set has its own radii. Its thesis table holds the same numbers, which a test compares.
"""

from typing import Final

DRUM_RADIUS: Final = 0.645
"""Radius r_d of the bench's drum [m] (thesis, Table 3.1)."""
TRUCK_RATIO: Final = 14.0
"""Motor speed over wheel speed of the truck [1]."""
WHEEL_RADIUS: Final = 0.1715
"""Radius r_w of the truck's drive wheel [m]; assumption: usual size of a reach truck."""
