"""Times on which gateway and PLC agree; they belong to the contract of the bench's PLC."""

from typing import Final

SCAN: Final = 0.01
"""[s] Period in which the PLC makes one sample, and over which it averages the torque."""
HOLD: Final = 0.1
"""[s] Time for which the PLC continues along the slope of the last command.

Ten polls at 100 Hz, or one poll at the longest useful period.
"""
