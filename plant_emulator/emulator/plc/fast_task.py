"""The PLC's fast task: samples the shaft torque every millisecond for its mean and integral."""

from numpy import float64
from numpy.typing import NDArray


class FastTask:
    """Torque now [N m], its mean over the last scan [N m], its integral since the start [N m s].

    The trapezoidal rule makes the window of the mean end exactly at the speed samples.
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self.torque = self.mean = self.integral = 0.0

    def take(self, torque: NDArray[float64]) -> None:
        """Take the torque samples of one scan [N m], shape (steps,)."""
        before, self.torque = self.torque, float(torque[-1])
        self.mean = (float(torque.sum()) + (before - self.torque) / 2) / len(torque)
        self.integral += self.mean * len(torque) * self._step
