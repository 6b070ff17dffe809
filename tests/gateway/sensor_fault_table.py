"""How soon each fault of a sensor trips, beside the bound that physics sets.

    python -m tests.gateway.sensor_fault_table 8

draws the noise of the sensors with this seed and prints one row a fault, speed and driver: reason,
time with the drum above 1 rad/s until the trip, the bound, the drum's speed at the trip and what it
gained until SAFE. A fault at speed begins at five moments, 0.2 s apart; times are the mean and the
longest.

The bound is the time that an observer needs who knows the fault to come: its form, its size and
its first sample. He hears the same run as the gateway, with the same noise. Of the bench he knows
what a gateway can know: the balance of motor torque, shaft torque and acceleration in every window,
for the second before the fault as well. The torque of the shaft enters no other balance that is
free of the truck's unknown torque. He has to bear

- the noise of the balance. Its autocovariance is taken from sound runs at the same speed: sensors,
  and what a poll does not see of a current that changes within a scan;
- drifted parameters: DRIFT and DRIFT_SHARE, constant over the run, learnt from the balance;
- the configured rate of false alarms, counted over all ticks, because a fault may begin in any, and
  shared by all faults of the table, because any of them may.

He trips when the balance is likelier with the fault than without it, by the inverse of the rate:

    min_d (y - D d)' C^-1 (y - D d) - min_d (y - e - D d)' C^-1 (y - e - D d) > 2 ln(1 / rate)

Without a fault a likelihood ratio exceeds 1 / rate with a probability of the rate at most (Ville).
No test for a fault at an unknown time has a shorter mean delay at this rate, but for a time that
does not depend on the rate (G. Lorden, Annals of Mathematical Statistics 42 (1971) 1897). None of
the detector's tolerances and levels enters. A sensor that has lost its noise has no bound here.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, product
from math import inf, log
from statistics import fmean

import numpy as np
from scipy.linalg import cholesky, solve_triangular, toeplitz
from scipy.optimize import lsq_linear

from gateway.arrays import Array
from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.plausibility.relations import motor_torque
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
BOUNDED = ("torque inverted", "torque x2", "torque +6 N m", "torque -6 N m")
Pair = tuple[Measurement, Measurement]
"""What the sensors show without and with the fault."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One fault: time above FAST [s]; drum, gained : speed at the trip, gain until SAFE [rad/s]."""

    reason: str
    time: float
    drum: float
    gained: float


def run(name: str, kmh: float, driver: str, moment: float, *, seed: int | None = 7) -> Run:
    """One fault that begins at one moment [s]. Raises AssertionError where it is not seen."""
    loop = driving(kmh, driver, seed=seed)
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


def bound(
    balance: Array, error: Array, torque: Array, covariance: Array, rarity: float
) -> float | None:
    """Time after which the balance is likelier with the fault by exp(rarity) [s]; None: never.

    balance : HISTORY windows before the fault and n faulty ones [N m], (HISTORY + n,)
    error : of the balance by the fault, from the first faulty window on [N m], (n,)
    torque : of the motor [N m], as long as the balance
    covariance : autocovariance of a sound balance [N^2 m^2], lags from 0 on, (m,)
    """
    limit, rows = np.array([DRIFT, DRIFT_SHARE]), len(balance)
    column = np.zeros(rows)
    column[: len(covariance)] = covariance[:rows]
    root = cholesky(toeplitz(column), lower=True)
    sound = balance - np.concatenate((np.zeros(HISTORY), error))
    drift = np.column_stack((np.ones(rows), torque))
    given, rest, known = (
        solve_triangular(root, one, lower=True) for one in (drift, balance, sound)
    )

    def misfit(shown: Array) -> float:
        found = lsq_linear(given[: len(shown)], shown, bounds=(-limit, limit))
        return 2.0 * float(found.cost)

    for count in range(1, len(error) + 1):
        end = HISTORY + count
        if misfit(rest[:end]) - misfit(known[:end]) > 2.0 * rarity:
            return count * SCAN
    return None


def bound_of(name: str, kmh: float, driver: str, moment: float, *, seed: int) -> float | None:
    """Bound of a fault of the torque sensor, on the run as it goes on without a trip [s]."""
    loop = driving(kmh, driver, seed=seed)
    watched = loop.state.watched
    deaf = {one: inf for one in vars(watched.relations) if one.endswith("_level")}
    deaf |= {"stuck_torque": inf, "rarity": inf}
    relations = replace(watched.relations, **deaf)
    loop.state = replace(loop.state, watched=replace(watched, relations=relations))
    loop.run(moment)
    before = [one.measurement for one in loop.observations[-HISTORY - 1 :]]
    pairs, _ = faulty(loop, name, BLIND)
    heard = [*before, *(shown for _, shown in pairs)]
    true = np.array([_mean(one) for one in (*before[1:], *(true for true, _ in pairs))])
    error = np.array([_mean(shown) - _mean(true) for true, shown in pairs])
    own = Config()
    rarity = -log(own.plausibility.false_alarms * own.loop.period / len(FAULTS))
    return bound(_residual(loop, heard), error, -true, noise(kmh, driver), rarity)


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
    kept, noisy = list[Measurement](), Noisy(np.random.default_rng(1000 + seed))

    def disturbed(one: ClosedLoop, reading: Reading) -> Reading:
        assert isinstance(reading, Measurement)
        kept.append(noisy(one, reading))
        return kept[-1]

    loop.disturb = disturbed
    loop.run(3.0)
    return _residual(loop, kept)


def _residual(loop: ClosedLoop, samples: Sequence[Measurement | None]) -> Array:
    """Residual of the motor's balance between samples [N m]; one less than the samples."""
    p = loop.state.watched.relations
    return np.array(
        [
            (motor_torque(p, one) + motor_torque(p, two)) / 2.0
            + _mean(two)
            - p.motor_inertia * (two.motor_speed - one.motor_speed) / SCAN
            for one, two in pairwise(samples)
            if one is not None and two is not None
        ]
    )


def _mean(sample: Measurement | None) -> float:
    assert sample is not None
    assert sample.shaft_torque_mean is not None
    return sample.shaft_torque_mean


def _text(runs: Sequence[Run], bounds: Sequence[float | None]) -> str:
    """Reason of the slowest run, times, bounds and speeds of a row."""
    slowest, times = max(runs, key=lambda one: one.time), [one.time for one in runs]
    seen = [one for one in bounds if one is not None]
    told = f"{fmean(seen):5.2f} {max(seen):5.2f}" if seen and len(seen) == len(runs) else "-"
    return (
        f"{slowest.reason:12s} {fmean(times):5.2f} {max(times):5.2f}  {told:11s} "
        f"{max(one.drum for one in runs):5.2f} {max(0.0, *(one.gained for one in runs)):6.2f}"
    )


def rows(seed: int) -> Iterator[str]:
    """Lines of the table. A fault of the torque at speed that keeps its noise has a bound."""
    yield f"{'fault':18s} km/h driver {'reason':12s} mean  max    bound max   drum  gained"
    for name, kmh, driver in product(FAULTS, SPEEDS, DRIVERS):
        moments = MOMENTS if kmh else MOMENTS[:1]
        runs = [run(name, kmh, driver, moment, seed=seed) for moment in moments]
        bounded = moments if kmh and name in BOUNDED else ()
        bounds = [bound_of(name, kmh, driver, moment, seed=seed) for moment in bounded]
        yield f"{name:18s} {kmh:4d} {driver:6s} {_text(runs, bounds)}"


if __name__ == "__main__":
    for line in rows(int(sys.argv[1])):
        print(line, flush=True)
