"""One-dimensional scans by simulation: from first guesses to the basin of the optimum.

In cruise the drum floats in the gap, and a tiny torque decides where the deceleration finds it. So
the cost of a fit has many local minima over the gap, the damping and the start position. A scan
with a robust loss chooses the basin; least squares then finds its minimum.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.robust_scan import cauchy_loss
from plant_emulator.model.stage import GAP_POSITION

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

    Progress = Callable[[str, float], None]

# A scan: name, factor either way, values. Coarse over what a first guess may be off, then fine.
# The flux comes first: from some value on the voltage does not suffice for the speeds asked. Its
# loss is flat from there on, and the least loss stands in a narrow valley at the edge.
SCANS: tuple[tuple[str, float, int], ...] = (
    ("flux_constant_1", 1.25, 15),
    ("flux_constant_1", 1.03, 13),
    (GAP_POSITION, 1.0, 9),
    ("dead_time", 2.5, 27),
    ("backlash_half_gap", 2.2, 31),
    (GAP_POSITION, 1.0, 21),
    ("drum_shaft_damping", 3.0, 13),
    ("dead_time", 1.1, 11),
    ("backlash_half_gap", 1.15, 21),
    (GAP_POSITION, 1.0, 41),
)
FINE_SCANS = SCANS[-3:]
# Accuracy of a scan: tolerance and largest step [s].
SCAN_TOLERANCE, SCAN_STEP = 1e-3, 0.1
# Relative difference of the loss that tells no value from another; the nearest of these is taken. A
# flux for which the voltage suffices changes the loss by some percent where no current is measured,
# and one for which it does not by more than half.
SAME_LOSS = 1e-3
SAME_LOSS_OF_FLUX = 0.05


class StartSearch:
    """Search from a parameter set for start values in the basin of the optimum.

    values : parameters [SI], scanned where free; gaps : start in the gap of every run, -1 to 1
    progress : called with a stage's name and how far it has come, 0 to 1
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        values: Mapping[str, float],
        free: Sequence[str],
        progress: Progress | None = None,
    ) -> None:
        self.recordings, self.free, self.progress = recordings, free, progress
        self.values = dict(values)
        self.gaps = [0.0] * len(recordings)
        self.simulations = 0

    def loss(self, run: int, values: Mapping[str, float], gap: float) -> float:
        """Cauchy's loss of a run at these values [SI] and this gap position."""
        self.simulations += 1
        residual = self.recordings[run].residual(values, gap, SCAN_TOLERANCE, SCAN_STEP)
        return cauchy_loss(residual)

    def total(self, values: Mapping[str, float]) -> float:
        """Loss of all runs at the gap positions found so far [1]; values : of all parameters."""
        return sum(self.loss(k, values, gap) for k, gap in enumerate(self.gaps))

    def scan(self, scans: Sequence[tuple[str, float, int]] = SCANS) -> None:
        """Make the scans in order; each starts from the best values of the one before."""
        for done, (name, factor, count) in enumerate(scans):
            if self.progress is not None:
                self.progress("start values", done / len(scans))
            if name == GAP_POSITION:
                self.scan_gaps(count)
            elif name in self.free:
                self._scan(name, np.geomspace(1.0 / factor, factor, count))

    def _scan(self, name: str, factors: Array) -> None:
        # Where a log does not show the parameter, it stays as it is.
        nearest = [1.0, *sorted(factors, key=lambda factor: abs(np.log(factor)))]
        candidates = [{**self.values, name: self.values[name] * factor} for factor in nearest]
        losses = np.array([self.total(candidate) for candidate in candidates])
        same = SAME_LOSS_OF_FLUX if name == "flux_constant_1" else SAME_LOSS
        self.values = candidates[int(np.argmax(losses <= (1.0 + same) * losses.min()))]

    def scan_gaps(self, count: int) -> None:
        """Choose the gap position of every run among `count` positions and the present one."""
        for k, gap in enumerate(self.gaps):
            positions = [gap, *np.linspace(-1.0, 1.0, count)]
            losses = [self.loss(k, self.values, float(g)) for g in positions]
            self.gaps[k] = float(positions[int(np.argmin(losses))])
