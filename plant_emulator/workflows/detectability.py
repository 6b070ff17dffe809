"""Detection limits of all effects in recorded or planned runs, as a library call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from plant_emulator.diagnosis.design.detectability import detection_limits, effect_detectability
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.parameter_sets import DEFAULT, with_effects
from plant_emulator.workflows.arguments import check_reference, list_logs
from plant_emulator.workflows.planned_runs import prepare

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from plant_emulator.diagnosis.design.detectability import EffectDetectability
    from plant_emulator.signals.log import Log

SCHEMA = "detectability/1"


@dataclass(frozen=True, kw_only=True, repr=False)
class Detectability:
    """Detection limits in some runs; `print` shows them as the command `detectability` does.

    effects : of the library, the one that shows best first
    notes : what was noticed about the logs, a sentence each
    """

    effects: tuple[EffectDetectability, ...]
    notes: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """The document `detectability/1`."""
        return {"schema": SCHEMA, "effects": [effect.to_json() for effect in self.effects]}

    def to_text(self) -> str:
        """A line for every effect: its smallest size, and what it cannot be told from or needs."""
        head = f"{'effect':28}{'smallest size that shows':42}cannot be told from, or needs"
        return "\n".join([head, *(_line(effect) for effect in self.effects)])

    def __str__(self) -> str:
        return self.to_text()

    def __repr__(self) -> str:
        shown = sum(effect.needs is None for effect in self.effects)
        return (
            f"<Detectability: {shown} of {len(self.effects)} effects show at their plausible size>"
        )


def detectability(
    runs: str | Path | Log | Sequence[str | Path | Log],
    *,
    parameters: ParameterSet | str | Path = DEFAULT,
    reference: Literal["linear", "staircase"] | None = None,
) -> Detectability:
    """Find what recorded and planned runs show together of every effect.

    runs : logs, paths of log files, or names of drive programs
    parameters : a parameter set, the name of a shipped one, or the path of its file
    reference : what holds between samples of the speed reference; None: as the log says
    Raises InputError for a log, a program or a set that cannot be used.
    """
    runs = list_logs(runs)
    check_reference(reference)
    if not isinstance(parameters, ParameterSet):
        parameters = with_effects.load(parameters)
    model, fitted, notes = prepare(runs, parameters, reference)
    found = detection_limits(model, fitted, range(len(runs)))
    found.sort(key=lambda limit: -limit.orthogonal_norm)
    effects = [effect_detectability(limit, model.candidates[limit.effect]) for limit in found]
    return Detectability(effects=tuple(effects), notes=notes)


def _line(found: EffectDetectability) -> str:
    sizes = ", ".join(_size(found, name) for name in found.smallest_size)
    remark = ", ".join(found.indistinguishable[1:]) or found.needs or ""
    return f"{found.effect:28}{sizes:42}{remark}".rstrip()


def _size(found: EffectDetectability, name: str) -> str:
    size, hidden = found.smallest_size[name], found.hidden_up_to.get(name)
    if size is None and hidden is None:
        return f"{name}: none"
    text = f"{name} {size:.2g}" if size is not None else f"{name} > {hidden:.2g}"
    return f"{text} {found.units[name]}".removesuffix(" 1")
