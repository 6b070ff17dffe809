"""How soon each fault of a sensor trips, beside the bound that tolerance and noise set.

    python -m tests.gateway.sensor_fault_table

prints one row a fault, speed and driver: reason, time with the drum above 1 rad/s until the trip,
two bounds of that time, the drum's speed at the trip and what it gained until SAFE.

The first bound is the time of an observer who knows the error of the sensor itself. He has to bear
what a sound sensor on a drifted bench may show: the tolerance k of each relation, and the level h
of its noise. So he may trip when the sum of the error beyond k reaches h, in any of the three
relations, or when a speed has stood still for as many samples as its noise cannot. The error
follows the run: it fades where the fault slows its own bench.

That observer knows that the bench itself shows nothing: its residual without the fault is zero. A
drifted bench shows up to k and h, and nobody can tell it from the error. Where it stands against
the error, the sum shown is that of the error beyond k, less k and h once more. So an alarm that
bears every sound bench is certain when the sum of the error beyond 2 k reaches 2 h: the second
bound. It needs the run as it goes on without a trip, here for 3 s more.

"-" says that the run does not come to the bound.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from gateway.cycle.plausibility import Plausibility, judge, motor_tolerance
from gateway.cycle.stuck import STUCK
from gateway.cycle.supervisor import State
from gateway.cycle.tolerances import Params
from register_maps.signals import Measurement
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop, Reading
from tests.gateway.sensor_faults import FAULTS, driving

SPEEDS, DRIVERS = (0, 5, 14), ("none", "pi")
LONGEST = 1200
"""Scans after which a fault counts as unseen."""
MORE = 300
"""Scans of the run without a trip beyond the trip."""
FAST = 1.0
"""[rad/s] Speed of the drum from which on the time counts."""
Pair = tuple[Measurement, Measurement]
"""What the sensors show without and with the fault."""


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Times above FAST [s]; drum, gained : speed at the trip, and what the drum gains [rad/s].

    bound, certain : first and second bound; None: the run does not come to it
    """

    reason: str
    time: float
    bound: float | None
    certain: float | None
    drum: float
    gained: float


def cell(name: str, kmh: float, driver: str) -> Cell:
    """One fault at one speed."""
    loop = driving(kmh, driver)
    p, begin = loop.state.watched.relations, len(loop.drum_speed)
    pairs, drum = faulty(loop, name, LONGEST)
    reason = loop.last.reason
    loop.run(4.0)
    blind = driving(kmh, driver)
    watched = blind.state.watched
    deaf = replace(p, motor_level=inf, gear_level=inf, drum_level=inf)
    blind.state = replace(blind.state, watched=replace(watched, relations=deaf))
    return Cell(
        reason="-" if reason is None else reason.name,
        time=float(SCAN * np.sum(drum > FAST)),
        bound=bound(p, pairs, drum),
        certain=bound(p, *faulty(blind, name, len(drum) + MORE), sides=2.0),
        drum=float(drum[-1]),
        gained=max(loop.drum_speed[begin:]) - max(float(drum[0]), FAST),
    )


def faulty(loop: ClosedLoop, name: str, longest: int) -> tuple[list[Pair], np.ndarray]:
    """Samples without and with the fault, and the drum's speed, until RUN ends or `longest`."""
    begin, fault, sound = len(loop.drum_speed), FAULTS[name](), loop.disturb
    pairs: list[Pair] = []

    def disturbed(one: ClosedLoop, reading: Reading) -> Reading:
        true = sound(one, reading)
        assert isinstance(true, Measurement)
        pairs.append((true, fault(true)))
        return pairs[-1][1]

    loop.disturb = disturbed
    while loop.last.state is State.RUN and len(loop.drum_speed) - begin < longest:
        loop.run(SCAN)
    return pairs, np.array(loop.drum_speed[begin:])


def bound(
    p: Params, pairs: Sequence[Pair], drum: np.ndarray, *, sides: float = 1.0
) -> float | None:
    """Time above FAST until the observer may trip [s]; None: he may not in this run.

    sides : of the tolerance and the level that he has to bear; 2: the bench stands at the far one
    """
    sums, before, still, sound = np.zeros((2, 3)), np.zeros(3), 0, Plausibility()
    levels = np.array([p.motor_level, p.gear_level, p.drum_level])
    held: Pair | None = None
    for count, ((true, shown), _) in enumerate(zip(pairs, drum, strict=False), 1):
        assert true.shaft_torque_mean is not None
        assert shown.shaft_torque_mean is not None
        error = np.array(
            [
                shown.shaft_torque_mean - true.shaft_torque_mean,
                shown.motor_speed - true.motor_speed,
                shown.drum_speed - true.drum_speed,
            ]
        )
        torque, (motor, wheel) = error[0] * SCAN, error[1:] - before[1:]
        growth = np.array(
            [
                torque - p.motor_inertia * motor,
                (error[1] / p.gear_ratio - error[2]) * SCAN,
                p.drum_inertia * wheel + p.gear_ratio * torque,
            ]
        )
        if held is not None:
            mean = true.shaft_torque_mean
            sound = judge(p, sound, held[0], true, torque=mean, duration=SCAN)
        tolerances = SCAN * np.array(
            [
                motor_tolerance(p, sound.envelope, sound.acceleration, 1.0),
                p.speed + p.speed_share * abs(true.drum_speed),
                p.truck_torque,
            ]
        )
        sums = np.maximum(sums + np.array([growth, -growth]) - sides * tolerances, 0.0)
        still = still + 1 if held is not None and _stands(held[1], shown) else 1
        held, before = (true, shown), error
        if np.any(sums > sides * levels) or still > STUCK:
            return float(SCAN * np.sum(drum[:count] > FAST))
    return None


def _text(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds:.2f}"


def _stands(before: Measurement, now: Measurement) -> bool:
    """Whether one of the speeds is the same to the last bit."""
    return before.motor_speed == now.motor_speed or before.drum_speed == now.drum_speed


def main() -> None:
    """Print the table."""
    print(
        f"{'fault':18s} km/h driver {'reason':13s} {'time':>6s} {'bound':>6s} {'certain':>7s} "
        f"{'drum':>6s} gained"
    )
    for name in FAULTS:
        for kmh in SPEEDS:
            for driver in DRIVERS:
                found = cell(name, kmh, driver)
                print(
                    f"{name:18s} {kmh:4d} {driver:6s} {found.reason:13s} {found.time:6.2f} "
                    f"{_text(found.bound):>6s} {_text(found.certain):>7s} {found.drum:6.2f} "
                    f"{max(found.gained, 0.0):6.2f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
