"""Draws the cases of a trial: the same number of the same seed is always the same case.

Kinds come in shuffled decks of twenty: five without an effect (two of them without any drift), ten
with one effect, two with two, three with one outside the library. Single and outside effects go
round, so that each comes up as often as any other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

import numpy as np

from plant_emulator.blind.case import Case, Hidden, Kind
from plant_emulator.blind.catalogue import INSIDE, OUTSIDE, Entry

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.blind.catalogue import Range
    from plant_emulator.effects import Effect, EffectParameter
    from plant_emulator.model.parameters import ParameterSet

DECK: dict[Kind, int] = {"none": 2, "drift": 3, "effect": 10, "two": 2, "outside": 3}
KINDS = [kind for kind in get_args(Kind) for _ in range(DECK[kind])]
# Sizes over the plausible one; shape constants over theirs.
SIZES = (0.5, 2.0)
SHAPES = (0.75, 1.25)
# A parameter drifts by its prior deviation, but not by more than so many [deviations].
FURTHEST = 2.5
PROGRAMS = ("program1", "program2", "program3")
# Runs that some benches have besides, whatever they hide: the programs must not tell the effect.
FURTHER = {"program4": 0.05, "program6": 0.05}


def kinds(seed: int, count: int) -> list[Kind]:
    """Kinds of the first cases of a seed."""
    found: list[Kind] = []
    for deck in range(-(-count // len(KINDS))):
        order = np.random.default_rng([seed, 1, deck]).permutation(len(KINDS))
        found += [KINDS[k] for k in order]
    return found[:count]


def _in_turn(entries: Sequence[Entry], seed: int, stream: int, index: int) -> Entry:
    """The entry that comes up as number `index` when all go round in shuffled order."""
    turn, place = divmod(index, len(entries))
    order = np.random.default_rng([seed, stream, turn]).permutation(len(entries))
    return entries[int(order[place])]


def draw(seed: int, number: int, parameters: ParameterSet, known: Mapping[str, Effect]) -> Case:
    """Case `number`, from 0, of a seed.

    known : the library's effects and the trial's own laws by name
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
    programs = _programs(entries, random)
    return Case(
        number=number,
        kind=kind,
        programs=programs,
        hidden=tuple(
            _hidden(entry, known, len(programs), kind == "outside", random) for entry in entries
        ),
        parameters={} if kind == "none" else _drift(parameters, random),
        gaps=tuple(float(gap) for gap in random.uniform(-1.0, 1.0, len(programs))),
        noise=int(random.integers(1 << 31)),
    )


def _programs(entries: Sequence[Entry], random: np.random.Generator) -> tuple[str, ...]:
    needed = {name for entry in entries for name in entry.programs}
    drawn = {name for name, share in FURTHER.items() if random.random() < share}
    return (*PROGRAMS, *sorted(needed | drawn))


def _drift(parameters: ParameterSet, random: np.random.Generator) -> dict[str, float]:
    """Values of everything that drifts [SI]."""
    drifting = [p for p in parameters if p.kind == "estimated" and p.std is not None]
    steps = np.clip(random.standard_normal(len(drifting)), -FURTHEST, FURTHEST)
    return {
        p.name: p.value + float(z) * (p.std or 0.0) for p, z in zip(drifting, steps, strict=True)
    }


def _hidden(
    entry: Entry,
    known: Mapping[str, Effect],
    runs: int,
    outside: bool,
    random: np.random.Generator,
) -> Hidden:
    law = known[entry.law]
    declared = law.parameters
    values = {
        key: _value(one, entry.ranges.get(key), random)
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


def _value(
    declared: EffectParameter, drawn_from: Range | None, random: np.random.Generator
) -> float:
    """A size around the plausible one, evenly on a logarithmic scale, or a shape constant [SI]."""
    if drawn_from is not None:
        drawn = random.uniform(*drawn_from)
    elif declared.neutral == declared.plausible:
        drawn = declared.plausible * random.uniform(*SHAPES)
    else:
        factor = float(np.exp(random.uniform(*np.log(SIZES))))
        sign = 1.0 if declared.lower >= 0.0 or random.random() < 0.5 else -1.0
        drawn = sign * declared.plausible * factor
    return float(np.clip(drawn, declared.lower, declared.upper))
