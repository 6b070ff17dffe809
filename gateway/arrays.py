"""The arrays that the gateway computes with."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Values of one signal over time, in SI; shape (n,) where nothing else is said."""
