"""The parity relations of an axis: both sides of its equation of motion through the same kernel.

    M q'' + friction(q', q, t) = F

The second divided difference of a measured position IS the acceleration, averaged with a triangle
over two sample periods; the first difference of a measured velocity is its average over one. The
force and every law are averaged with the same kernel. Nothing is differentiated or filtered on one
side only, so that no delay or elasticity is invented. Times may be uneven.

A fast log has a noisy second difference. A weighted sum of relations is a relation: neighbours are
summed until the position's noise is small beside the force (the method of modulating functions, M.
Shinbrot, Trans. ASME 79 (1957) 547).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


# Relations that a run keeps.
FEWEST_ROWS = 100


@dataclass(frozen=True)
class Kernel:
    """The averages of one run.

    time : of the samples [s], shape (n,); of_velocity : the velocity was measured
    stride : neighbouring relations that are summed to one
    """

    time: Array
    of_velocity: bool
    stride: int

    @property
    def nodes(self) -> Array:
        """Times at which a law is evaluated: the samples and the middles between [s]."""
        found = np.empty(2 * len(self.time) - 1)
        found[::2], found[1::2] = self.time, 0.5 * (self.time[:-1] + self.time[1:])
        return found

    @property
    def rows(self) -> Array:
        """Middle of each relation [s]."""
        own = 0.5 * (self.time[:-1] + self.time[1:]) if self.of_velocity else self.time[1:-1]
        return self._sum(own)

    def acceleration(self, measured: Array) -> Array:
        """Averaged acceleration of measured positions, or velocities, shape (rows,)."""
        slope = np.diff(measured) / np.diff(self.time)
        return self._sum(slope if self.of_velocity else np.diff(slope) / self._widths)

    def average(self, law: Array) -> Array:
        """Average of values at the nodes, shape (rows,), by Simpson's rule in every interval."""
        step, left, middle, right = np.diff(self.time), law[:-2:2], law[1::2], law[2::2]
        if self.of_velocity:
            return self._sum((left + 4.0 * middle + right) / 6.0)
        rising, falling = step * (2.0 * middle + right) / 6.0, step * (left + 2.0 * middle) / 6.0
        return self._sum((rising[:-1] + falling[1:]) / self._widths)

    @property
    def _widths(self) -> Array:
        """Area below each triangle [s]."""
        step = np.diff(self.time)
        return np.asarray(0.5 * (step[:-1] + step[1:]))

    def _sum(self, relations: Array) -> Array:
        """Weighted means of neighbouring relations."""
        if self.stride == 1:
            return relations
        box = np.ones(self.stride)
        kernel = np.convolve(box, box)
        if not self.of_velocity:
            kernel = np.convolve(kernel, box)
        width = np.diff(self.time) if self.of_velocity else self._widths
        total = np.convolve(relations * width, kernel, "valid")
        return np.asarray((total / np.convolve(width, kernel, "valid"))[:: self.stride])


def stride_of(
    time: Array, measured: Array, *, of_velocity: bool, noise: float, allowed: float, share: float
) -> int:
    """Neighbours to sum, so that the motion's noise is small in a relation.

    noise : deviation of a measured position or velocity
    allowed : acceleration that a force of the size of its noise makes
    share : of the averaged acceleration's variance that the noise may have
    White noise: a sum over m neighbours lowers it by m^2.5 for a position, by m^1.5 for a velocity;
    a relation of neighbours holds sqrt(1/2) of the force's noise.
    """
    period = float(np.median(np.diff(time)))
    power, gain = (1.5, np.sqrt(2.0) / period) if of_velocity else (2.5, np.sqrt(6.0) / period**2)
    wanted = (np.sqrt(2.0) * noise * gain / max(allowed, 1e-300)) ** (1.0 / power)
    most = max(1, len(time) // FEWEST_ROWS)
    stride = int(np.clip(np.ceil(wanted), 1, most))
    while stride < most:
        whole = float(np.var(Kernel(time, of_velocity, stride).acceleration(measured)))
        if (noise * gain / stride**power) ** 2 <= share * whole:
            break
        stride = min(most, 1 + stride + stride // 4)
    return stride
