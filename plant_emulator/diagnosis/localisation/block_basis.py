"""The unknown laws of the blocks: what may go on in a block that nobody has thought of.

Each block may hold any torque, or any error of its signal, that is a smooth function of what the
block itself sees: its speed, load, direction, angle, rates, and time. An unknown law is a sum of
linear splines with unknown coefficients, so that no form is assumed. The block says in which
relations its laws act. The quantities come from the measured motor speed and from the simulation of
the drum subsystem. No law can thus be made of the noise of the signals that it is to explain.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.diagnosis.localisation.linear_splines import linear_splines, time_splines
from plant_emulator.diagnosis.localisation.measured_signals import (
    STILL_SPEED,
    interval_means,
    turned_angle,
)
from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    MOTOR,
    ROWS,
    delayed_reference,
)
from plant_emulator.model.array_laws import flux, gear_friction
from plant_emulator.signals.smoothing import smooth

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.localisation.measured_signals import MeasuredSignals
    from plant_emulator.signals.log import Array

# Smoothing window of the quantities [s].
SMOOTHING_WINDOW = 0.15
# Steps between the knots of laws of time [s].
SLOW_KNOTS, FAST_KNOTS = 2.0, 0.5
# Units of the quantities: current [A], torque [N m], acceleration [rad/s^2]. In these units a
# coefficient of 1 is of the order of the noise.
CURRENT_UNIT, TORQUE_UNIT, ACCELERATION_UNIT = 5.0, 5.0, 10.0
# Knots near standstill, where friction may rise or fall [rad/s at the motor].
NEAR_STANDSTILL = np.array([0.0, 1.25, 3.0, 6.0, 12.5, 25.0, 50.0])


@dataclass(frozen=True)
class BlockQuantities:
    """Quantities inside the blocks of a run [SI], at its samples or as means over its intervals.

    speed, acceleration : of the motor
    torque, current : that speed and load ask for; torque_rate, torque_curvature : its derivatives
    load : torque from the shaft to the drum; angle : of the gear's output
    drum_speed : of the drum subsystem, which follows the measured motor speed
    demand : delayed speed reference; demand_rate, demand_curvature : its derivatives
    wheel_torque : of the truck; truck : whether there is one
    """

    time: Array
    speed: Array
    acceleration: Array
    current: Array
    flux: Array
    torque: Array
    torque_rate: Array
    torque_curvature: Array
    load: Array
    angle: Array
    drum_speed: Array
    demand: Array
    demand_rate: Array
    demand_curvature: Array
    wheel_torque: Array
    truck: bool

    def means(self) -> BlockQuantities:
        """The means over the intervals, shape (n - 1,) each."""
        names = [field.name for field in fields(self) if field.name != "truck"]
        own: dict[str, Any] = {name: interval_means(getattr(self, name)) for name in names}
        return replace(self, **own)

    @property
    def moving(self) -> Array:
        """Direction of the motion: 1, -1, or 0 at standstill."""
        return np.where(np.abs(self.speed) > STILL_SPEED, np.sign(self.speed), 0.0)

    def ranges(self) -> dict[str, float]:
        """Largest absolute value of each quantity that laws depend on."""
        names = ("speed", "current", "torque", "load", "demand_rate", "wheel_torque")
        return {name: float(np.max(np.abs(getattr(self, name)))) for name in names}


def block_quantities(
    m: MeasuredSignals, drum_speed: Array, p: Mapping[str, float]
) -> BlockQuantities:
    """Compute the quantities inside the blocks of a run at its samples, shape (n,) each.

    drum_speed : of the drum subsystem, simulated with the measured motor speed [rad/s]
    """
    xi, t = p["gear_ratio"], m.time
    truck = np.concatenate([m.drum_torque[:1], m.drum_torque])
    load = p["drum_inertia"] * smooth(t, drum_speed, 0.07, 1) - truck
    torque = -(load + gear_friction(m.speed / xi, p)) / xi
    acceleration = smooth(t, m.speed, SMOOTHING_WINDOW, 1)
    current = (p["motor_inertia"] * acceleration - torque) / flux(m.speed, p)
    demand = delayed_reference(m, p["dead_time"])
    channels = {
        "speed": m.speed,
        "acceleration": smooth(t, m.speed, 2.0 * SMOOTHING_WINDOW, 1),
        "current": current,
        "flux": flux(m.speed, p),
        "torque": smooth(t, torque, SMOOTHING_WINDOW),
        "torque_rate": smooth(t, torque, SMOOTHING_WINDOW, 1),
        "torque_curvature": smooth(t, torque, SMOOTHING_WINDOW, 2),
        "load": load,
        "angle": turned_angle(t, m.speed / xi),
        "drum_speed": drum_speed,
        "demand": demand,
        "demand_rate": smooth(t, demand, SMOOTHING_WINDOW, 1),
        "demand_curvature": smooth(t, demand, SMOOTHING_WINDOW, 2),
        "wheel_torque": truck * p["wheel_radius"] / p["drum_radius"],
    }
    return BlockQuantities(time=t, truck=m.truck, **channels)


@dataclass(frozen=True)
class UnknownLaw:
    """The columns of an unknown law in the relations of a run, shape (ROWS, n - 1, k).

    own : whether each run has coefficients of its own
    """

    rows: Array
    own: bool = False


def acting_in(where: Mapping[int, float], columns: Array) -> Array:
    """Columns that act in these relations with these factors, shape (ROWS, n - 1, k).

    columns : shape (n - 1, k)
    """
    rows = np.zeros((ROWS, *columns.shape))
    for row, weight in where.items():
        rows[row] = weight * columns
    return rows


def _times(columns: Array, factor: Array) -> Array:
    return columns * factor[:, None]


def _knots(largest: float, count: int) -> Array:
    return np.linspace(0.0, max(largest, 1e-6), count)


def _both(largest: float, count: int) -> Array:
    return np.linspace(-max(largest, 1e-6), max(largest, 1e-6), count)


def motor(q: BlockQuantities, top: Mapping[str, float]) -> list[UnknownLaw]:
    """Unknown laws of the motor.

    A torque by speed, current, flux and current, acceleration, time. Where the voltage is logged,
    also an electromotive force by speed, and a resistance by current and time.
    """
    speed, current = (
        linear_splines(np.abs(q.speed), _knots(top["speed"], 9)),
        q.current / CURRENT_UNIT,
    )
    rates = np.stack([q.acceleration, q.acceleration * current, current * np.abs(q.current)], -1)
    flowing = np.tanh(q.current**2)
    slow = time_splines(q.time, SLOW_KNOTS)
    lost = _times(linear_splines(np.abs(q.current), _knots(top["current"], 7)), flowing * q.flux)
    return [
        UnknownLaw(acting_in({MOTOR: 1.0}, _times(speed, q.moving))),
        UnknownLaw(acting_in({MOTOR: 1.0}, _times(lost, np.sign(q.current)))),
        UnknownLaw(
            acting_in(
                {MOTOR: 1.0}, _times(linear_splines(q.current, _both(top["current"], 12)), flowing)
            )
        ),
        UnknownLaw(acting_in({MOTOR: 1.0}, _times(speed, current))),
        UnknownLaw(acting_in({MOTOR: 1.0}, rates / ACCELERATION_UNIT)),
        UnknownLaw(acting_in({MOTOR: 1.0}, _times(slow, current)), own=True),
        UnknownLaw(acting_in({MOTOR: 1.0}, _times(slow, q.moving)), own=True),
        UnknownLaw(acting_in({ARMATURE: 1.0}, _times(speed, q.moving))),
        UnknownLaw(acting_in({ARMATURE: 1.0}, _times(speed, current))),
        UnknownLaw(
            acting_in({ARMATURE: 1.0}, linear_splines(q.current, _both(top["current"], 12)))
        ),
        UnknownLaw(acting_in({ARMATURE: 1.0}, _times(slow, current)), own=True),
    ]


def torque_sensor(q: BlockQuantities, top: Mapping[str, float]) -> list[UnknownLaw]:
    """Unknown errors of the torque sensor, in both its relations.

    Constant, by torque, by the rate of the torque, by time.
    """
    where = {MOTOR: -1.0, GEAR: 1.0}
    seconds = (q.time - q.time[0]) / 20.0
    slow, torque = time_splines(q.time, SLOW_KNOTS), q.torque / TORQUE_UNIT
    rates = np.stack(
        [q.torque_rate / ACCELERATION_UNIT, q.torque_curvature / ACCELERATION_UNIT**2], -1
    )
    return [
        UnknownLaw(acting_in(where, np.stack([np.ones_like(seconds), seconds], -1))),
        UnknownLaw(acting_in(where, linear_splines(q.torque, _both(top["torque"], 10)))),
        UnknownLaw(acting_in(where, np.stack([torque, seconds * q.torque / TORQUE_UNIT], -1))),
        UnknownLaw(acting_in(where, rates)),
        UnknownLaw(acting_in(where, slow), own=True),
        UnknownLaw(acting_in(where, _times(slow, torque)), own=True),
    ]


def gear(q: BlockQuantities, top: Mapping[str, float]) -> list[UnknownLaw]:
    """Unknown friction of the gear: by speed, direction, load, angle of its output, time."""
    where = {GEAR: 1.0}
    speed = linear_splines(np.abs(q.speed), _knots(top["speed"], 9))
    minutes = linear_splines(q.time, np.linspace(0.0, 60.0, 8))
    turns = [f(k * q.angle) for k in (1, 2) for f in (np.cos, np.sin)]
    warm = q.moving * np.sqrt(np.abs(q.speed) / 100.0)
    return [
        UnknownLaw(acting_in(where, _times(speed, q.moving))),
        UnknownLaw(
            acting_in(where, _times(linear_splines(np.abs(q.speed), NEAR_STANDSTILL), q.moving))
        ),
        UnknownLaw(acting_in(where, _times(speed, np.minimum(q.moving, 0.0)))),
        UnknownLaw(
            acting_in(where, _times(linear_splines(q.load, _both(top["load"], 10)), q.moving))
        ),
        UnknownLaw(acting_in(where, _times(time_splines(q.time, SLOW_KNOTS), q.moving)), own=True),
        UnknownLaw(acting_in(where, np.stack(turns, -1))),
        UnknownLaw(acting_in(where, _times(minutes, warm))),
    ]


def drive(q: BlockQuantities, top: Mapping[str, float]) -> list[UnknownLaw]:
    """Unknown laws of the drive.

    A shift of the speed that the drive asks for, by the reference's rates, current, time. Where the
    voltage is logged, also a voltage between drive and armature by current, or by time.

    Aliasing of the converter's ripple makes the current look larger or smaller alike in both
    directions. A fault of the flux changes its sign with the current.
    """
    where = {DRIVE: 1.0}
    rates = np.stack(
        [q.demand_rate / ACCELERATION_UNIT, q.demand_curvature / ACCELERATION_UNIT**2], -1
    )
    ramping = np.tanh((q.demand_rate / 3.0) ** 2)
    ripple = (
        linear_splines(np.abs(q.current), _knots(top["current"], 7))
        * np.tanh(q.current**2)[:, None]
    )
    return [
        UnknownLaw(
            acting_in(
                where, _times(linear_splines(q.demand_rate, _both(top["demand_rate"], 8)), ramping)
            )
        ),
        UnknownLaw(acting_in(where, rates)),
        UnknownLaw(acting_in({MOTOR: -1.0}, _times(ripple, q.flux))),
        UnknownLaw(acting_in(where, linear_splines(q.current, _both(top["current"], 12)))),
        UnknownLaw(acting_in(where, time_splines(q.time, SLOW_KNOTS)), own=True),
        UnknownLaw(acting_in(where, time_splines(q.time, FAST_KNOTS, 40)), own=True),
        UnknownLaw(
            acting_in({ARMATURE: 1.0}, linear_splines(q.current, _both(top["current"], 12)))
        ),
        UnknownLaw(acting_in({ARMATURE: 1.0}, time_splines(q.time, SLOW_KNOTS)), own=True),
    ]


def wheel_contact(q: BlockQuantities, top: Mapping[str, float]) -> list[UnknownLaw]:
    """Unknown torque between the truck's wheel and the drum: by speed, wheel torque, time."""
    where = {GEAR: float(q.truck)}
    speed = linear_splines(np.abs(q.speed), _knots(top["speed"], 9))
    return [
        UnknownLaw(acting_in(where, _times(speed, q.moving))),
        UnknownLaw(
            acting_in(where, linear_splines(q.wheel_torque, _both(top["wheel_torque"], 10)))
        ),
        UnknownLaw(acting_in(where, _times(time_splines(q.time, SLOW_KNOTS), q.moving)), own=True),
    ]


BLOCKS: Mapping[str, Callable[[BlockQuantities, Mapping[str, float]], list[UnknownLaw]]] = {
    "motor": motor,
    "torque_sensor": torque_sensor,
    "gear": gear,
    "drive": drive,
    "wheel_contact": wheel_contact,
}


def largest(runs: Sequence[BlockQuantities]) -> dict[str, float]:
    """Largest absolute value of each quantity in all runs."""
    ranges = [q.ranges() for q in runs]
    return {name: max(r[name] for r in ranges) for name in ranges[0]}
