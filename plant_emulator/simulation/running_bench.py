"""The running bench of the emulator: the model, advanced by a few fixed steps at a time."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, isfinite
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import EmulatorError, UnsettledError
from plant_emulator.simulation.sensing import RunningSensor
from plant_emulator.simulation.simulate import values_of
from plant_emulator.solver.kernel import Kernel, kernel_for, vector
from plant_emulator.solver.stepper import CHANNELS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.signals.log import Array

BENCH_STEP = 1e-3
# How much longer than nominal effects may make the dead time [s]: the history reaches that far.
LONGER_DEAD_TIME = 0.5
(
    MOTOR_SPEED,
    DRUM_SPEED,
    ARMATURE_CURRENT,
    SHAFT_TORQUE,
    ARMATURE_VOLTAGE,
    SHELL_TEMPERATURE,
    WHEEL_TORQUE,
) = range(len(CHANNELS))


@dataclass(frozen=True, kw_only=True)
class BenchSamples:
    """Sensor values of some steps [SI]: arrays have one value a step, shape (steps,).

    wheel_torque : mean torque of the truck at its wheel, reaction of the brake included [N m]
    felt_drum_speed : drum speed after the last step that a truck feels, without declared sensors
    shell_temperature : after the last step [K]
    motor_angle, drum_angle : since the start of the bench, after the last step [rad]
    """

    motor_speed: Array
    drum_speed: Array
    armature_current: Array
    armature_voltage: Array
    shaft_torque: Array
    wheel_torque: float
    felt_drum_speed: float
    shell_temperature: float
    motor_angle: float
    drum_angle: float


class Bench:
    """Drive, motor, gear and drum. The bench is at rest until it is advanced.

    effects : effect -> parameter -> value [SI]
    gap_position : start in the backlash gap, -1 to 1; step : length of a step [s]
    truck : whether a truck stands on the drum
    seed : of the noise of the set's declared sensors; None: they show no noise
    kernel : the kernel to use; None: the smallest that has these effects
    """

    def __init__(
        self,
        parameters: ParameterSet,
        effects: Mapping[str, Mapping[str, float]] | None = None,
        *,
        gap_position: float = 0.0,
        truck: bool = False,
        step: float = BENCH_STEP,
        seed: int | None = None,
        kernel: Kernel | None = None,
    ) -> None:
        values: Mapping[str, float] = values_of(parameters, effects)
        self._kernel, values = (kernel, values) if kernel is not None else kernel_for(values)
        self._p = self._kernel.parameter_record(values)
        self._stage = self._kernel.stage_record()
        self._stage.truck = float(truck)
        self._x = self._kernel.state(self._p, gap_position * self._p.backlash_half_gap)
        self._work = self._kernel.work()
        self._longest_dead_time = self._p.dead_time + LONGER_DEAD_TIME
        # The first stage of a step looks back less than one step further than its end.
        self._history = vector([0.0] * (ceil(self._longest_dead_time / step) + 3))
        self._newest = 0
        self._step = step
        self._sensors = {
            CHANNELS.index(name): RunningSensor(sensor, seed)
            for name, sensor in parameters.sensors.items()
        }
        self._motor_angle = 0.0
        self._drum_angle = 0.0
        self._truck = (0.0, 0.0)
        self._own_current_limit = self._p.armature_current_limit

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return float(self._stage.time)

    @property
    def unsettled(self) -> int:
        """Number of implicit stages so far whose equations were not solved."""
        return int(self._stage.unsettled)

    def advance(
        self, references: Sequence[float], *, wheel_torque: float = 0.0, brake_torque: float = 0.0
    ) -> BenchSamples:
        """Advance by one step for each reference and return the values of the sensors.

        references : reference of the PLC at the end of each step, before the dead time of the
            drive, linear between the steps [rad/s]
        wheel_torque : drive torque of the truck at its wheel [N m]
        brake_torque : largest torque that its brake holds, >= 0 [N m at the wheel]
        Raises EmulatorError where the dead time lies outside of the history, and UnsettledError
        where the state is not finite any more.
        """
        self._load(wheel_torque, brake_torque)
        out = np.zeros((len(references), len(CHANNELS)))
        self._newest = self._kernel.advance(
            vector([float(r) for r in references]),
            self._history,
            self._newest,
            self._step,
            self._x,
            self._work,
            self._stage,
            self._p,
            out,
        )
        if self._newest < 0:
            raise EmulatorError(
                f"bench at {self.time:g} s: the drive's dead time, with its effects, lies outside "
                f"of 0 to {self._longest_dead_time:.4g} s, which the running bench remembers"
            )
        sums = out.sum(axis=0).tolist()
        if not isfinite(sum(sums)):
            raise UnsettledError(f"bench at {self.time:g} s: its state is not finite any more")
        self._motor_angle += sums[MOTOR_SPEED] * self._step
        self._drum_angle += sums[DRUM_SPEED] * self._step
        felt = float(out[-1, DRUM_SPEED])
        self._sense(out)
        return BenchSamples(
            motor_speed=out[:, MOTOR_SPEED],
            drum_speed=out[:, DRUM_SPEED],
            armature_current=out[:, ARMATURE_CURRENT],
            armature_voltage=out[:, ARMATURE_VOLTAGE],
            shaft_torque=out[:, SHAFT_TORQUE],
            wheel_torque=sums[WHEEL_TORQUE] / len(out),
            felt_drum_speed=felt,
            shell_temperature=float(out[-1, SHELL_TEMPERATURE]),
            motor_angle=self._motor_angle,
            drum_angle=self._drum_angle,
        )

    def limit_current(self, limit: float) -> None:
        """Limit the current reference of the drive to the lesser of this and its own limit [A]."""
        self._p.armature_current_limit = min(limit, self._own_current_limit)

    def _sense(self, out: Array) -> None:
        """Let the declared sensors show the channels of these steps."""
        for column, sensor in self._sensors.items():
            time = self.time + self._step * np.arange(1.0 - len(out), 1.0)
            out[:, column] = sensor.show(time, out[:, column])

    def _load(self, wheel_torque: float, brake_torque: float) -> None:
        """Set the truck's torques if they changed: writing to a record costs more than a step."""
        if (wheel_torque, brake_torque) != self._truck:
            self._stage.wheel_torque, self._stage.brake_torque = wheel_torque, brake_torque
            self._truck = (wheel_torque, brake_torque)
