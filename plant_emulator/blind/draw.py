"""Draws the cases of a trial. Seed and number determine a case completely.

The kinds come in shuffled decks of twenty cases. Five have no effect, two of them with nominal
parameters. Ten have one effect of the library, two have two, three have one outside the library.
Effects are dealt round by round, so each comes up equally often.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

import numpy as np

from plant_emulator.blind.case import Case, Hidden, Kind
from plant_emulator.blind.catalogue import INSIDE, OUTSIDE, Entry
from plant_emulator.blind.dirt import draw_dirt

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.blind.catalogue import Range
    from plant_emulator.effects import Effect, EffectParameter
    from plant_emulator.model.parameters import ParameterSet

DECK: dict[Kind, int] = {"none": 2, "deviation": 3, "effect": 10, "two": 2, "outside": 3}
KINDS = [kind for kind in get_args(Kind) for _ in range(DECK[kind])]
# Ranges of a size and of a shape constant, each over its plausible value.
SIZE_RANGE = (0.5, 2.0)
DRAWN_SHAPES = (0.75, 1.25)
# Largest parameter deviation [prior standard deviations].
FURTHEST = 2.5
PROGRAMS = ("program1", "program2", "program3")
# Probability of an additional program, whatever a case hides: the programs must not betray the
# effect.
FURTHER = {"program4": 0.05, "program6": 0.05}


def kinds(seed: int, count: int) -> list[Kind]:
    """Kinds of the first `count` cases of a seed."""
    found: list[Kind] = []
    for deck in range(-(-count // len(KINDS))):
        order = np.random.default_rng([seed, 1, deck]).permutation(len(KINDS))
        found += [KINDS[k] for k in order]
    return found[:count]


def _in_turn(entries: Sequence[Entry], seed: int, stream: int, index: int) -> Entry:
    """Entry number `index` of the entries dealt round by round, each round in shuffled order."""
    turn, place = divmod(index, len(entries))
    order = np.random.default_rng([seed, stream, turn]).permutation(len(entries))
    return entries[int(order[place])]


def draw(seed: int, number: int, parameters: ParameterSet, effects: Mapping[str, Effect]) -> Case:
    """Draw case `number` of a seed; the first number is 0.

    parameters : the nominal set
    effects : the library's effects and the trial's own laws by name
    """
    before = kinds(seed, number + 1)
    kind = before.pop()
    random = np.random.default_rng([seed, 0, number])
    entries: list[Entry] = []
    if kind == "effect":
        entries = [_in_turn(INSIDE, seed, 2, before.count(kind))]
    elif kind == "outside":
        entries = [_in_turn(OUTSIDE, seed, 3, before.count(kind))]
    elif kind == "two":
        entries = [INSIDE[k] for k in random.choice(len(INSIDE), 2, replace=False)]
    programs = _draw_programs(entries, random)
    return Case(
        number=number,
        kind=kind,
        programs=programs,
        hidden=tuple(
            _hide(entry, effects, len(programs), kind == "outside", random) for entry in entries
        ),
        parameters={} if kind == "none" else _deviate(parameters, random),
        gaps=tuple(float(gap) for gap in random.uniform(-1.0, 1.0, len(programs))),
        noise=int(random.integers(1 << 31)),
        dirt=draw_dirt(seed, number),
    )


def _draw_programs(entries: Sequence[Entry], random: np.random.Generator) -> tuple[str, ...]:
    needed = {name for entry in entries for name in entry.programs}
    drawn = {name for name, share in FURTHER.items() if random.random() < share}
    return (*PROGRAMS, *sorted(needed | drawn))


def _deviate(parameters: ParameterSet, random: np.random.Generator) -> dict[str, float]:
    """Draw values of all estimated parameters from their priors [SI]."""
    deviating = [p for p in parameters if p.kind == "estimated" and p.std is not None]
    steps = np.clip(random.standard_normal(len(deviating)), -FURTHEST, FURTHEST)
    return {
        p.name: p.value + float(z) * (p.std or 0.0) for p, z in zip(deviating, steps, strict=True)
    }


def _hide(
    entry: Entry,
    effects: Mapping[str, Effect],
    runs: int,
    outside: bool,
    random: np.random.Generator,
) -> Hidden:
    """Draw the parameters of a hidden effect."""
    law = effects[entry.law]
    declared = law.parameters
    values = {
        key: _draw_value(one, entry.ranges.get(key), random)
        for key, one in declared.items()
        if not one.per_run
    }
    states = tuple(
        {
            key: float(random.uniform(*entry.starts[key]))
            for key in declared
            if declared[key].per_run
        }
        for _ in range(runs)
    )
    return Hidden(
        effect=entry.effect,
        law=entry.law,
        subsystem=law.subsystem,
        outside=outside,
        values=values,
        states=states,
    )


def _draw_value(
    declared: EffectParameter, given: Range | None, random: np.random.Generator
) -> float:
    """Draw a size (log-uniform around the plausible one) or a shape constant (uniform) [SI].

    given : range to draw from uniformly instead
    """
    if given is not None:
        drawn = random.uniform(*given)
    elif declared.neutral == declared.plausible:
        drawn = declared.plausible * random.uniform(*DRAWN_SHAPES)
    else:
        factor = float(np.exp(random.uniform(*np.log(SIZE_RANGE))))
        sign = 1.0 if declared.lower >= 0.0 or random.random() < 0.5 else -1.0
        drawn = sign * declared.plausible * factor
    return float(np.clip(drawn, declared.lower, declared.upper))
