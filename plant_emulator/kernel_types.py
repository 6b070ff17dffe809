"""Types of the records that the kernel's functions share.

A Record is read and written by attribute; which attributes it has is data (`plant.STAGE` and the
parameter names), laid out when the kernel is built: a NumPy structured scalar for the compiled
kernel, a plain namespace for the uncompiled one. A State is the vector of the states in the order of
`plant`, a NumPy array or a list.
"""

from __future__ import annotations

from typing import Any

Record = Any
State = Any
