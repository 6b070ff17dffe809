"""Simulates programs 6 and 6L: a forklift on the drum, and a regulator that emulates the road.

The speed reference is that of the thesis (eq. 4.4, 4.8, 4.9, 4.12), once in each cycle of the PLC,
from the mean torque over the cycle. The inertia term is integrated exactly:

    omega_ref = rho omega_d + 1/(m r_d^2) integral (T_f(omega_d) + xi T_meas - T_RL) dt,
    rho = (J_g + J_d) / (m r_d^2)

With this regulator the emulator simulates travel programs, with effects, without a network. The
gateway has its own regulators and shares no code with this one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.model.laws import NOMINAL_SHELL_TEMPERATURE
from plant_emulator.signals.log import Log
from plant_emulator.simulation.programs import SAMPLE_PERIOD, TravelProgram, sample_times
from plant_emulator.simulation.running_bench import Bench, BenchSamples
from plant_emulator.simulation.truck import Driver, Forklift, ReplayedTorque

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.model.parameters import ParameterSet

# Step of the bench [s]. The bench takes the reference as linear within a step, a log takes it as a
# staircase: with this step the difference is below the noise.
TRAVEL_STEP = 1e-5


@dataclass
class ThesisReference:
    """The thesis's speed regulator; `update` is called once in each cycle."""

    parameters: ParameterSet
    truck: Forklift
    period: float = SAMPLE_PERIOD
    drum_reference: float = 0.0
    _drum_speed: float = 0.0

    def update(self, shaft_torque: float, drum_speed: float) -> float:
        """Update and return the motor speed reference [rad/s].

        shaft_torque : measured, mean over the cycle [N m]; drum_speed : at its end [rad/s]
        """
        value = self.parameters.value
        inertia = self.truck.mass * self.truck.drum_radius**2
        rho = (value("gear_inertia") + value("drum_inertia")) / inertia
        size, sign = abs(drum_speed), float(np.sign(drum_speed))
        viscous = value("gear_viscous_friction") * size ** value("gear_friction_exponent")
        friction = (value("gear_coulomb_friction") + viscous) * sign
        load = self.truck.road_load(drum_speed * self.truck.drum_radius) * self.truck.drum_radius
        torque = friction + value("gear_ratio") * shaft_torque - load
        self.drum_reference += (
            rho * (drum_speed - self._drum_speed) + torque / inertia * self.period
        )
        # The PLC takes no negative speed. The limited sum is kept, so that it does not wind up.
        self.drum_reference = max(0.0, self.drum_reference)
        self._drum_speed = drum_speed
        return value("gear_ratio") * self.drum_reference


def simulate_travel(
    program: TravelProgram,
    parameters: ParameterSet,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    *,
    gap_position: float = 0.0,
    driver: Driver | None = None,
    step: float = TRAVEL_STEP,
) -> Log:
    """Simulate a travel program in closed loop: truck, bench and regulator; all signals SI.

    effects : effect -> parameter -> value [SI]; gap_position : start in the backlash gap, -1 to 1
    driver : the truck's driver; None: the torque that the cycle takes on the road
    step : of the bench [s], a part of SAMPLE_PERIOD
    """
    truck = Forklift(mass=program.mass)
    who = driver or ReplayedTorque(truck)
    bench = Bench(parameters, effects, gap_position=gap_position, truck=True, step=step)
    regulator = ThesisReference(parameters, truck)
    time = sample_times(program.duration)
    rows = np.zeros((len(time), 7))
    rows[:, 6] = NOMINAL_SHELL_TEMPERATURE
    steps = round(SAMPLE_PERIOD / step)
    drum_speed, reference = 0.0, 0.0
    for k in range(1, len(time)):
        drive, brake = who.torques(float(time[k - 1]), drum_speed * truck.drum_radius)
        samples = bench.advance([reference] * steps, wheel_torque=drive, brake_torque=brake)
        drum_speed = float(samples.drum_speed[-1])
        reference = regulator.update(float(samples.shaft_torque.mean()), drum_speed)
        rows[k] = (reference, *_last(samples))
    names = (
        "speed_reference",
        "motor_speed",
        "drum_speed",
        "armature_current",
        "shaft_torque",
        "wheel_torque",
        "shell_temperature",
    )
    signals = {name: rows[:, k] for k, name in enumerate(names)}
    return Log(time, signals, program.name)


def _last(samples: BenchSamples) -> tuple[float, ...]:
    """Signals of the log at the end of one cycle, after the speed reference [SI]."""
    return (
        float(samples.motor_speed[-1]),
        float(samples.drum_speed[-1]),
        float(samples.armature_current[-1]),
        float(samples.shaft_torque[-1]),
        samples.wheel_torque,
        samples.shell_temperature,
    )
