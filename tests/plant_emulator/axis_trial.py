"""A trial of the axis diagnosis: axes with one hidden effect of the library, and axes without.

    python -m tests.plant_emulator.axis_trial --seeds 1 52

A seed is a case. Of 52 seeds in a row, 32 hide each effect of the library at two sizes, and 20 hide
none. The sampling rate (100, 250, 1000 Hz), the axis, its noise and its drive follow from the seed.
Each case with an effect is diagnosed again without its effect in the library: `unknown` is right.

Right is one named effect whose class holds the hidden one. Seeds 1 to 99 are for tuning. Seeds from
1001 on judge: they are run once, on code that is finished.
"""

import argparse
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import lfilter

from plant_emulator.diagnosis.answer import Answer
from plant_emulator.diagnosis.axis.diagnose import AxisRuns, diagnose_axis
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.workflows.diagnosis.plan import plan_of_runs
from tests.plant_emulator.axis_simulation import STEP, Axis, Drive, run

LENGTH = 12.0
"""Of a run [s]; two are fitted, one is predicted."""
RATES = (100, 250, 1000)
WITHOUT = 20
"""Cases without an effect."""
NOISE, MEMORY = 0.01, 0.005
"""Of the logged force, in the force that accelerates the axis, and its time constant [s]."""
METRE = 0.02
"""Of a linear axis, per radian of a rotary one."""

Scale = dict[str, float]
# By effect: the constants at a size, small or large, of an axis with these scales.
EFFECTS: dict[str, tuple[tuple[float, float], Callable[[float, Scale], dict[str, float]]]] = {
    "viscous_asymmetry": ((0.2, 0.4), lambda x, s: {"viscous_asymmetry": x * s["viscous"]}),
    "coulomb_asymmetry": ((0.3, 0.6), lambda x, s: {"coulomb_asymmetry": x * s["coulomb"]}),
    "stribeck": (
        (0.5, 1.0),
        lambda x, s: {"stribeck": x * s["coulomb"], "stribeck_speed": 0.06 * s["speed"]},
    ),
    "concave_friction": ((0.5, 1.0), lambda x, s: {"concave": x * s["force"]}),
    "quadratic_drag": ((0.3, 0.6), lambda x, s: {"drag": x * s["force"]}),
    "presliding": ((0.01, 0.03), lambda x, s: {"bristle": x * s["travel"]}),
    "load_friction": ((0.06, 0.15), lambda x, _: {"load_ratio": x}),
    "warm_up": ((0.4, 0.8), lambda x, s: {"warm_up": x, "warm_up_time": 0.3 * LENGTH}),
    "gravity": ((0.2, 0.6), lambda x, s: {"gravity": x * s["force"]}),
    "position_ripple": ((0.1, 0.3), lambda x, s: {"ripple": x * s["force"]}),
    "backlash": (
        (0.01, 0.03),
        lambda x, s: (
            {"gap": x * s["travel"], "share": 0.3, "behind": 0.7}
            | _spring(0.3 * s["inertia"], 400.0, 0.3)
        ),
    ),
    "elasticity": (
        (110.0, 55.0),
        lambda x, s: {"share": 0.5} | _spring(0.5 * s["inertia"], x, 0.05),
    ),
    "torque_constant": ((4.0, 2.5), lambda x, s: {"saturation": x * s["force"]}),
    "delay": ((3.0, 6.0), lambda x, s: {"delay": x * s["period"]}),
    "force_lag": ((3.0, 6.0), lambda x, s: {"lag": x * s["period"]}),
    "position_dependence": (
        (0.2, 0.5),
        lambda x, s: {"slope": x * s["force"], "slope_friction": 0.3 * x * s["force"]},
    ),
}
WITHHELD = {"gravity": ("gravity", "position_ripple")}
"""Effects with the law of another one: a ripple of one period a revolution is gravity's law."""
ROTARY = ("gravity", "position_ripple")
"""Effects of an angle."""


def _spring(inertia: float, frequency: float, damping: float) -> dict[str, float]:
    """Spring and damper of an inertia, by frequency [rad/s] and damping ratio [1]."""
    return {
        "stiffness": inertia * frequency**2,
        "damping": 2.0 * damping * inertia * frequency,
    }


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case; effect : that is hidden, None: none; size : 0 small, 1 large; rate : [Hz]."""

    seed: int
    effect: str | None
    size: int
    rate: int

    @property
    def rotary(self) -> bool:
        """Whether the axis turns."""
        return self.effect in ROTARY or self.seed % 2 == 1


def case(seed: int) -> Case:
    """The case of a seed."""
    names, k = list(EFFECTS), (seed - 1) % (2 * len(EFFECTS) + WITHOUT)
    hidden = names[k // 2] if k < 2 * len(names) else None
    return Case(seed=seed, effect=hidden, size=k % 2, rate=RATES[k % len(RATES)])


def logs(one: Case) -> tuple[AxisLog, ...]:
    """The three runs of a case."""
    random = np.random.default_rng(one.seed)
    unit = 1.0 if one.rotary else METRE
    sizes = np.array([9.0, 1.5, 0.15]) * random.uniform(0.7, 1.3, 3) * unit
    rates = 2.0 * np.pi * np.array([0.2, 0.8, 3.0]) * random.uniform(0.8, 1.2, 3)
    inertia = 10.0 ** random.uniform(-3.0, 0.0) / unit**2
    force = inertia * float(np.linalg.norm(sizes * rates**2)) / np.sqrt(2.0)
    speed, travel = float(sizes @ rates), float(sizes.sum())
    viscous, coulomb = random.uniform(0.1, 0.3) * force / speed, random.uniform(0.1, 0.3) * force
    scale = {"force": force, "speed": speed, "travel": travel, "inertia": inertia}
    scale |= {"viscous": viscous, "coulomb": coulomb, "period": 1.0 / one.rate}
    planted: dict[str, float] = {}
    if one.effect is not None:
        planted_sizes, law = EFFECTS[one.effect]
        planted = law(planted_sizes[one.size], scale)
    axis = Axis(
        inertia=inertia,
        viscous=viscous,
        coulomb=coulomb,
        width=0.01 * speed,
        offset=random.uniform(-0.05, 0.05) * force,
        middle=0.0,
        travel=travel,
        speed=speed,
        **planted,
    )
    return tuple(_log(one, axis, sizes, rates, force, random, k) for k in range(3))


def _log(
    one: Case,
    axis: Axis,
    sizes: np.ndarray,
    rates: np.ndarray,
    force: float,
    random: np.random.Generator,
    number: int,
) -> AxisLog:
    tones = 2.0 * np.pi * np.geomspace(5.0, 20.0, 8)
    # A load is logged where the friction grows with it.
    load = force if one.effect == "load_friction" else 0.0
    drive = Drive(
        sizes=sizes,
        rates=rates,
        phases=random.uniform(0.0, 2.0 * np.pi, 3),
        dither=np.full(8, 0.1 * force),
        tones=tones,
        turns=random.uniform(0.0, 2.0 * np.pi, 8),
        load=load,
        load_rate=random.uniform(2.0, 4.0),
        count=axis.travel / 2**14,
    )
    time, position, command, given = run(axis, drive, LENGTH)
    every = round(1.0 / (one.rate * STEP))
    time, position, command, given = (x[::every] for x in (time, position, command, given))
    kept = float(np.exp(-1.0 / (one.rate * MEMORY)))
    white = random.standard_normal(len(time))
    noise = NOISE * force * np.sqrt(1.0 - kept**2) * lfilter([1.0], [1.0, -kept], white)
    return AxisLog(
        time=time,
        position=drive.count * np.round(position / drive.count),
        force=command + noise,
        rotary=one.rotary,
        source=f"seed {one.seed}, run {number + 1}",
        load=given if load else None,
    )


def diagnosed(runs: tuple[AxisLog, ...], without: tuple[str, ...] = ()) -> Answer:
    """The answer of two fitted runs and a held-out one."""
    return diagnose_axis(AxisRuns(runs, without), plan_of_runs(3, 2), settings={}).answer


def is_right(effect: str | None, answer: Answer) -> bool:
    """Whether an answer names the hidden effect, up to its class, and nothing else."""
    verdict = answer.verdict
    if effect is None:
        return verdict.kind in ("none", "parameter")
    return len(verdict.classes) == 1 and effect in verdict.classes[0]


def main() -> None:
    """Run the trial."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", nargs=2, type=int, default=(1, 52), metavar=("FIRST", "LAST"))
    parser.add_argument("--only", nargs="*", default=(), metavar="EFFECT")
    first, last = (given := parser.parse_args()).seeds
    counts: Counter[str] = Counter()
    for one in map(case, range(first, last + 1)):
        if given.only and one.effect not in given.only:
            continue
        _tell(one, counts)
    print(_summary(counts))


def _tell(one: Case, counts: Counter[str]) -> None:
    runs = logs(one)
    answer = diagnosed(runs)
    right = is_right(one.effect, answer)
    kind = "effect" if one.effect else "none"
    counts[kind] += 1
    counts[f"{kind} right"] += right
    counts["none named"] += one.effect is None and bool(answer.verdict.effects)
    print(_line(one, "", answer, right=right), flush=True)
    if one.effect is None:
        return
    withheld = diagnosed(runs, WITHHELD.get(one.effect, (one.effect,)))
    counts["unknown"] += withheld.verdict.kind == "unknown"
    counts["withheld named"] += bool(withheld.verdict.effects)
    print(
        _line(one, "  without it", withheld, right=withheld.verdict.kind == "unknown"), flush=True
    )


def _line(one: Case, mark: str, answer: Answer, *, right: bool) -> str:
    verdict: Any = answer.verdict
    named = "; ".join(" = ".join(names) for names in verdict.classes)
    hidden = mark or f"{one.effect or 'no effect'} {one.size}"
    sure = "right" if right else "WRONG"
    return f"{one.seed:5} {one.rate:5} Hz  {hidden:22} {sure}  {verdict.kind}: {named}"


def _summary(counts: Counter[str]) -> str:
    return (
        f"{counts['effect right']} of {counts['effect']} hidden effects right at class level; "
        f"{counts['none named']} false names in {counts['none']} cases without one; withheld "
        f"{counts['unknown']} of {counts['effect']} unknown, {counts['withheld named']} false names"
    )


if __name__ == "__main__":
    main()
