"""A bench so simple that its numbers can be told by hand: the motor is where its reference is.

Drum speed = motor speed / 62.6; shaft torque rises by 1 N m with every sub-step, from 1.
"""

from collections.abc import Sequence

import numpy as np

from plant_emulator.emulator.plc.surroundings import Backlash
from plant_emulator.simulation.running_bench import BenchSamples

RATIO = 62.6
STEP = 1e-3
BACKLASH = Backlash(ratio=RATIO, half_gap=0.15)


class LinearBench:
    """Follows its reference without delay; remembers what was asked of it."""

    def __init__(self) -> None:
        self.references: list[float] = []
        self.wheel: list[tuple[float, float]] = []
        self.current_limit = 72.0
        self.push = 0.0
        self.unsettled = 0
        self.angle = 0.0

    def limit_current(self, limit: float) -> None:
        self.current_limit = limit

    def advance(
        self, references: Sequence[float], *, wheel_torque: float = 0.0, brake_torque: float = 0.0
    ) -> BenchSamples:
        first = len(self.references) + 1
        self.references += references
        self.wheel.append((wheel_torque, brake_torque))
        speed = np.array(references) + self.push
        self.angle += float(speed.sum()) * STEP
        return BenchSamples(
            motor_speed=speed,
            drum_speed=speed / RATIO,
            armature_current=np.full(len(speed), 10.0),
            armature_voltage=np.full(len(speed), 50.0),
            shaft_torque=np.arange(first, first + len(speed), dtype=float),
            wheel_torque=wheel_torque,
            felt_drum_speed=float(speed[-1]) / RATIO,
            shell_temperature=305.15,
            motor_angle=self.angle,
            drum_angle=self.angle / RATIO,
        )
