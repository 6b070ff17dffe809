"""What might go on in a block that nobody has thought of: unknown laws of its own quantities.

Each block may hold any torque (or shift of its signal) that is a smooth function of what the block
itself sees: its speed, load, direction, angle, rates, and time. A law is a sum of hat functions
with unknown coefficients, so no form is assumed; where in the relations it acts is the block's.
The quantities come from the measured motor speed by the simulation of the drum's side, so that no
law can be made of the noise of the signals that it is to explain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.linear_splines import hats, of_time
from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    MOTOR,
    ROWS,
    STILL,
    delayed_reference,
    flux,
    friction,
    middle,
    turned,
)
from plant_emulator.signals.smoothing import smooth

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.localisation.parity_relations import Measured
    from plant_emulator.signals.log import Array

# Windows of the smooth quantities, and steps of laws of time [s].
WINDOW = 0.15
SLOW, FAST = 2.0, 0.5
# Units in which coefficients of order 1 are of the order of the noise: current [A], torque [N m],
# acceleration [rad/s^2].
CURRENT, TORQUE, ACCELERATION = 5.0, 5.0, 10.0
# Speeds of the motor near standstill, where friction may rise or fall [rad/s].
NEAR_STANDSTILL = np.array([0.0, 1.25, 3.0, 6.0, 12.5, 25.0, 50.0])


@dataclass(frozen=True)
class Inside:
    """Quantities inside the blocks over the intervals of a run, shape (n,) each [SI].

    load : torque from shaft to drum; torque, current : that speed and load ask for
    weight : of the truck's torque; ranges : largest of each quantity in all runs
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
    demand: Array
    demand_rate: Array
    demand_curvature: Array
    wheel_torque: Array
    truck: bool

    @property
    def moving(self) -> Array:
        """Direction of the motion, 0 at standstill."""
        return np.where(np.abs(self.speed) > STILL, np.sign(self.speed), 0.0)

    def ranges(self) -> dict[str, float]:
        """Largest absolute value of each quantity."""
        names = ("speed", "current", "torque", "load", "demand_rate", "wheel_torque")
        return {name: float(np.max(np.abs(getattr(self, name)))) for name in names}


def inside(m: Measured, drum_speed: Array, p: Mapping[str, float]) -> Inside:
    """The quantities of a run.

    drum_speed : of the drum's side, driven by the measured motor speed [rad/s]
    """
    xi, t = p["gear_ratio"], m.time
    truck = np.concatenate([m.drum_torque[:1], m.drum_torque])
    load = p["drum_inertia"] * smooth(t, drum_speed, 0.07, 1) - truck
    torque = -(load + friction(m.speed / xi, p)) / xi
    acceleration = smooth(t, m.speed, WINDOW, 1)
    current = (p["motor_inertia"] * acceleration - torque) / flux(m.speed, p)
    demand = delayed_reference(m, p["dead_time"])
    channels = {
        "speed": m.speed,
        "acceleration": smooth(t, m.speed, 2.0 * WINDOW, 1),
        "current": current,
        "flux": flux(m.speed, p),
        "torque": smooth(t, torque, WINDOW),
        "torque_rate": smooth(t, torque, WINDOW, 1),
        "torque_curvature": smooth(t, torque, WINDOW, 2),
        "load": load,
        "angle": turned(t, m.speed / xi),
        "demand": demand,
        "demand_rate": smooth(t, demand, WINDOW, 1),
        "demand_curvature": smooth(t, demand, WINDOW, 2),
        "wheel_torque": truck * p["wheel_radius"] / p["drum_radius"],
    }
    return Inside(
        time=middle(t), truck=m.truck, **{name: middle(value) for name, value in channels.items()}
    )


@dataclass(frozen=True)
class Law:
    """A group of columns of a run, shape (ROWS, n, k); own : coefficients of this run only."""

    rows: Array
    own: bool = False


def acting(where: Mapping[int, float], columns: Array) -> Array:
    """Columns (n, k) that act in these relations with these factors, shape (ROWS, n, k)."""
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


def motor(q: Inside, top: Mapping[str, float]) -> list[Law]:
    """A torque on the motor: by speed, current, flux and current, acceleration, time.

    And where it shows: an electromotive force by speed, a resistance by current and time.
    """
    speed, current = hats(np.abs(q.speed), _knots(top["speed"], 9)), q.current / CURRENT
    rates = np.stack([q.acceleration, q.acceleration * current, current * np.abs(q.current)], -1)
    flowing = np.tanh(q.current**2)
    slow = of_time(q.time, SLOW)
    lost = _times(hats(np.abs(q.current), _knots(top["current"], 7)), flowing * q.flux)
    return [
        Law(acting({MOTOR: 1.0}, _times(speed, q.moving))),
        Law(acting({MOTOR: 1.0}, _times(lost, np.sign(q.current)))),
        Law(acting({MOTOR: 1.0}, _times(hats(q.current, _both(top["current"], 12)), flowing))),
        Law(acting({MOTOR: 1.0}, _times(speed, current))),
        Law(acting({MOTOR: 1.0}, rates / ACCELERATION)),
        Law(acting({MOTOR: 1.0}, _times(slow, current)), own=True),
        Law(acting({MOTOR: 1.0}, _times(slow, q.moving)), own=True),
        Law(acting({ARMATURE: 1.0}, _times(speed, q.moving))),
        Law(acting({ARMATURE: 1.0}, _times(speed, current))),
        Law(acting({ARMATURE: 1.0}, hats(q.current, _both(top["current"], 12)))),
        Law(acting({ARMATURE: 1.0}, _times(slow, current)), own=True),
    ]


def torque_sensor(q: Inside, top: Mapping[str, float]) -> list[Law]:
    """An error of the torque sensor: constant, by torque, its rate, time; in both its relations."""
    where = {MOTOR: -1.0, GEAR: 1.0}
    seconds = (q.time - q.time[0]) / 20.0
    slow = of_time(q.time, SLOW)
    rates = np.stack([q.torque_rate / ACCELERATION, q.torque_curvature / ACCELERATION**2], -1)
    return [
        Law(acting(where, np.stack([np.ones_like(seconds), seconds], -1))),
        Law(acting(where, hats(q.torque, _both(top["torque"], 10)))),
        Law(acting(where, np.stack([q.torque / TORQUE, seconds * q.torque / TORQUE], -1))),
        Law(acting(where, rates)),
        Law(acting(where, slow), own=True),
        Law(acting(where, _times(slow, q.torque / TORQUE)), own=True),
    ]


def gear(q: Inside, top: Mapping[str, float]) -> list[Law]:
    """A friction of the gear: by speed, direction, load, angle of its output, time."""
    where = {GEAR: 1.0}
    speed = hats(np.abs(q.speed), _knots(top["speed"], 9))
    minutes = hats(q.time, np.linspace(0.0, 60.0, 8))
    turns = [f(k * q.angle) for k in (1, 2) for f in (np.cos, np.sin)]
    warm = q.moving * np.sqrt(np.abs(q.speed) / 100.0)
    return [
        Law(acting(where, _times(speed, q.moving))),
        Law(acting(where, _times(hats(np.abs(q.speed), NEAR_STANDSTILL), q.moving))),
        Law(acting(where, _times(speed, np.minimum(q.moving, 0.0)))),
        Law(acting(where, _times(hats(q.load, _both(top["load"], 10)), q.moving))),
        Law(acting(where, _times(of_time(q.time, SLOW), q.moving)), own=True),
        Law(acting(where, np.stack(turns, -1))),
        Law(acting(where, _times(minutes, warm))),
    ]


def drive(q: Inside, top: Mapping[str, float]) -> list[Law]:
    """A shift of the speed that the drive asks for: by the reference's rates, current, time.

    And where it shows: a voltage between drive and armature by current, or by time.

    The converter's ripple, folded down by the sampling, makes the current look larger or smaller
    alike in both directions; what ails the flux changes its sign with the current.
    """
    where = {DRIVE: 1.0}
    rates = np.stack([q.demand_rate / ACCELERATION, q.demand_curvature / ACCELERATION**2], -1)
    ramping = np.tanh((q.demand_rate / 3.0) ** 2)
    ripple = hats(np.abs(q.current), _knots(top["current"], 7)) * np.tanh(q.current**2)[:, None]
    return [
        Law(acting(where, _times(hats(q.demand_rate, _both(top["demand_rate"], 8)), ramping))),
        Law(acting(where, rates)),
        Law(acting({MOTOR: -1.0}, _times(ripple, q.flux))),
        Law(acting(where, hats(q.current, _both(top["current"], 12)))),
        Law(acting(where, of_time(q.time, SLOW)), own=True),
        Law(acting(where, of_time(q.time, FAST, 40)), own=True),
        Law(acting({ARMATURE: 1.0}, hats(q.current, _both(top["current"], 12)))),
        Law(acting({ARMATURE: 1.0}, of_time(q.time, SLOW)), own=True),
    ]


def wheel_contact(q: Inside, top: Mapping[str, float]) -> list[Law]:
    """A torque between the truck's wheel and the drum: by its torque, speed, time."""
    where = {GEAR: float(q.truck)}
    speed = hats(np.abs(q.speed), _knots(top["speed"], 9))
    return [
        Law(acting(where, _times(speed, q.moving))),
        Law(acting(where, hats(q.wheel_torque, _both(top["wheel_torque"], 10)))),
        Law(acting(where, _times(of_time(q.time, SLOW), q.moving)), own=True),
    ]


BLOCKS: Mapping[str, Callable[[Inside, Mapping[str, float]], list[Law]]] = {
    "motor": motor,
    "torque_sensor": torque_sensor,
    "gear": gear,
    "drive": drive,
    "wheel_contact": wheel_contact,
}


def largest(runs: Sequence[Inside]) -> dict[str, float]:
    """Largest of each quantity in all runs."""
    ranges = [q.ranges() for q in runs]
    return {name: max(r[name] for r in ranges) for name in ranges[0]}
