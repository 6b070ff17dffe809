"""How soon each fault of a sensor trips, beside the bound that physics sets.

    python -m tests.gateway.sensor_fault_table

prints one row a fault, speed and driver: reason, time with the drum above 1 rad/s until the trip,
the bound, the drum's speed at the trip and what it gained until SAFE. A fault at speed begins at
five moments, 0.2 s apart; times are the median and the longest.

The bound is the time after which an observer may trip who knows the fault to come: its form, its
size and its first sample. Of the bench he knows what a gateway can know: the balance of motor
torque, shaft torque and acceleration in every window, for the second before the fault as well. The
torque of the shaft enters no other balance that is free of the truck's unknown torque. He has to
bear

- the noise of the balance. Its autocovariance is taken from sound runs at the same speed: sensors,
  and what a poll does not see of a current that changes within a scan;
- drifted parameters: DRIFT and DRIFT_SHARE, constant over the run;
- the configured rate of false alarms, one test a tick.

He trips when what no drift explains of the error has more energy than noise has at that rate:
min_d (e - D d)' C^-1 (e - D d) > z^2 (a matched filter; half of the faults then trip). None of the
detector's tolerances and levels enters.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, product
from math import inf
from statistics import NormalDist, median

import numpy as np
from scipy.linalg import cholesky, solve_triangular, toeplitz
from scipy.optimize import lsq_linear

from gateway.arrays import Array
from gateway.configuration.config import Config
from gateway.cycle.plausibility import motor_torque
from gateway.cycle.supervisor import State
from register_maps.signals import Measurement
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop, Reading
from tests.gateway.drifted_bench import Noisy
from tests.gateway.sensor_faults import FAULTS, driving

SPEEDS, DRIVERS, MOMENTS = (0, 5, 14), ("none", "pi"), (0.0, 0.2, 0.4, 0.6, 0.8)
LONGEST, BLIND = 1200, 60
"""Scans after which a fault counts as unseen, and scans of the run that nobody ends."""
FAST = 1.0
"""[rad/s] Speed of the drum from which on the time counts."""
HISTORY, SOUND, MEMORY = 100, 6, 60
"""Scans before the fault, sound runs of 3 s for the noise, and scans over which it is coloured."""
DRIFT = 1.7
"""[N m] Offset of the torque sensor 0.5, friction of the motor 0.5, windage at 4000 rpm 0.7."""
DRIFT_SHARE = 0.17
"""K_1 10 % and K_2 2 % (two deviations of Table 3.1), torque sensor 3 %, armature reaction 2 %."""
Pair = tuple[Measurement, Measurement]
"""What the sensors show without and with the fault."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One fault: time above FAST [s]; drum, gained : speed at the trip, gain until SAFE [rad/s]."""

    reason: str
    time: float
    drum: float
    gained: float


def run(name: str, kmh: float, driver: str, moment: float, *, noise: bool = True) -> Run:
    """One fault that begins at one moment [s]. Raises AssertionError where it is not seen."""
    loop = driving(kmh, driver, noise=noise)
    loop.run(moment)
    begin = len(loop.drum_speed)
    _, drum = faulty(loop, name, LONGEST)
    assert loop.last.reason is not None, (name, kmh, driver, moment)
    reason = loop.last.reason.name
    loop.run(4.0)
    assert loop.last.state is State.SAFE
    return Run(
        reason=reason,
        time=float(SCAN * np.sum(drum > FAST)),
        drum=float(drum[-1]),
        gained=max(loop.drum_speed[begin:]) - max(float(drum[0]), FAST),
    )


def faulty(loop: ClosedLoop, name: str, longest: int) -> tuple[list[Pair], Array]:
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


def bound(error: Array, torque: Array, covariance: Array, level: float) -> float | None:
    """Time after which the error of the balance cannot be noise or drift [s]; None: it can.

    error, torque : of the balance, and of the motor, from the first faulty window on [N m], (n,)
    covariance : autocovariance of a sound balance [N^2 m^2], lags from 0 on, (m,)
    level : deviations of noise that are as rare as a false alarm may be
    """
    limit = np.array([DRIFT, DRIFT_SHARE])
    for count in range(1, len(error) + 1):
        rows = HISTORY + count
        column = np.zeros(rows)
        column[: len(covariance)] = covariance[:rows]
        root = cholesky(toeplitz(column), lower=True)
        shown = np.concatenate((np.zeros(HISTORY), error[:count]))
        motor = np.concatenate((np.full(HISTORY, torque[0]), torque[:count]))
        drift = np.column_stack((np.ones(rows), motor))
        white = [solve_triangular(root, one, lower=True) for one in (drift, shown)]
        if 2.0 * lsq_linear(white[0], white[1], bounds=(-limit, limit)).cost > level**2:
            return count * SCAN
    return None


def bound_of(name: str, kmh: float, driver: str, moment: float) -> float | None:
    """Bound of a fault of the torque sensor, on the run as it goes on without a trip [s]."""
    loop = driving(kmh, driver)
    watched = loop.state.watched
    deaf = {one: inf for one in vars(watched.relations) if one.endswith("_level")}
    deaf["stuck_torque"] = inf
    relations = replace(watched.relations, **deaf)
    loop.state = replace(loop.state, watched=replace(watched, relations=relations))
    loop.run(moment)
    pairs, _ = faulty(loop, name, BLIND)
    error = np.array([_mean(shown) - _mean(true) for true, shown in pairs])
    torque = np.array([-_mean(true) for true, _ in pairs])
    own = Config()
    chance = own.plausibility.false_alarms * own.loop.period
    return bound(error, torque, noise(kmh, driver), -NormalDist().inv_cdf(chance))


@cache
def noise(kmh: float, driver: str) -> Array:
    """Autocovariance of the balance of sound runs at a speed [N^2 m^2], (MEMORY,)."""
    runs = [_balance(kmh, driver, seed) for seed in range(SOUND)]
    mean = np.mean(runs)
    taper = 1.0 - np.arange(MEMORY) / MEMORY  # keeps the covariance positive
    products = [
        np.mean([np.mean((one[lag:] - mean) * (one[: len(one) - lag] - mean)) for one in runs])
        for lag in range(MEMORY)
    ]
    return np.array(products) * taper


def _balance(kmh: float, driver: str, seed: int) -> Array:
    """Residual of the motor's balance of a sound run of 3 s, a window each [N m]."""
    loop = driving(kmh, driver)
    p, kept = loop.state.watched.relations, list[Measurement]()
    noisy = Noisy(np.random.default_rng(1000 + seed))

    def disturbed(one: ClosedLoop, reading: Reading) -> Reading:
        assert isinstance(reading, Measurement)
        kept.append(noisy(one, reading))
        return kept[-1]

    loop.disturb = disturbed
    loop.run(3.0)
    return np.array(
        [
            (motor_torque(p, one) + motor_torque(p, two)) / 2.0
            + _mean(two)
            - p.motor_inertia * (two.motor_speed - one.motor_speed) / SCAN
            for one, two in pairwise(kept)
        ]
    )


def _mean(sample: Measurement) -> float:
    assert sample.shaft_torque_mean is not None
    return sample.shaft_torque_mean


def _text(runs: Sequence[Run], bounds: Sequence[float | None]) -> str:
    """Reason of the slowest run, times, bounds and speeds of a row."""
    slowest, times = max(runs, key=lambda one: one.time), [one.time for one in runs]
    seen = [one for one in bounds if one is not None]
    told = f"{median(seen):5.2f} {max(seen):5.2f}" if seen and len(seen) == len(runs) else "-"
    return (
        f"{slowest.reason:12s} {median(times):5.2f} {max(times):5.2f}  {told:11s} "
        f"{max(one.drum for one in runs):5.2f} {max(0.0, *(one.gained for one in runs)):6.2f}"
    )


def rows() -> Iterator[str]:
    """Lines of the table. Only a fault of the torque, at speed, has a bound."""
    yield f"{'fault':18s} km/h driver {'reason':12s} median max    bound max   drum  gained"
    for name, kmh, driver in product(FAULTS, SPEEDS, DRIVERS):
        moments = MOMENTS if kmh else MOMENTS[:1]
        runs = [run(name, kmh, driver, moment) for moment in moments]
        bounded = moments if kmh and "torque" in name else ()
        bounds = [bound_of(name, kmh, driver, moment) for moment in bounded]
        yield f"{name:18s} {kmh:4d} {driver:6s} {_text(runs, bounds)}"


if __name__ == "__main__":
    for line in rows():
        print(line, flush=True)
