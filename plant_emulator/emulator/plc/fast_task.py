"""The PLC's fast task: sees the shaft torque every millisecond, hands mean and integral on."""

from numpy import float64
from numpy.typing import NDArray


class FastTask:
    """Torque [N m] now, its mean over the last scan, its integral since the start [N m s].

    Integrated by trapezoids, so that the window is exactly that of the speeds at both of its ends.
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self.torque = self.mean = self.integral = 0.0

    def take(self, torque: NDArray[float64]) -> None:
        """Take the samples of one scan, one a step."""
        before, self.torque = self.torque, float(torque[-1])
        self.mean = (float(torque.sum()) + (before - self.torque) / 2) / len(torque)
        self.integral += self.mean * len(torque) * self._step
