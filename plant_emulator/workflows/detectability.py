"""Detection limits of all effects in recorded or planned runs, as a library call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from threadpoolctl import threadpool_limits

from plant_emulator.diagnosis.axis.detectability import detection_limits as axis_limits
from plant_emulator.diagnosis.design.detectability import detection_limits, effect_detectability
from plant_emulator.errors import InputError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.parameter_sets import DEFAULT, with_effects
from plant_emulator.workflows.arguments import check_choice, check_reference, list_logs
from plant_emulator.workflows.diagnosis.runs import axis_runs, bench_source
from plant_emulator.workflows.planned_runs import prepare

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from plant_emulator.diagnosis.design.detectability import EffectDetectability
    from plant_emulator.signals.axis_log import AxisLog
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
    runs: str | Path | Log | AxisLog | Sequence[str | Path | Log | AxisLog],
    *,
    model: Literal["bench", "axis"] = "bench",
    parameters: ParameterSet | str | Path = DEFAULT,
    reference: Literal["linear", "staircase"] | None = None,
    columns: Sequence[str] | Mapping[str, str] = (),
) -> Detectability:
    """Find what recorded and planned runs show together of every effect.

    runs : logs, paths of log files, or names of drive programs; of an axis logs, or parts in time
        of their files, FILE@12.5:20 [s]
    model : the roller bench, or a single motor-driven axis
    parameters : a parameter set, the name of a shipped one, or the path of its file
    reference : what holds between samples of the speed reference; None: as the log says
    columns : of the files of an axis, as {"position": "enc:deg", "force": "iq*0.40:Nm"}
    Raises InputError for a log, a program or a set that cannot be used.
    """
    runs = list_logs(runs)
    check_choice("model", model, ("bench", "axis"))
    check_reference(reference)
    if model == "axis":
        return _of_axis(runs, columns)
    if columns:
        raise InputError("columns belong to the model axis")
    if not isinstance(parameters, ParameterSet):
        parameters = with_effects.load(parameters)
    bench, fitted, notes = prepare([bench_source(one) for one in runs], parameters, reference)
    found = detection_limits(bench, fitted, range(len(runs)))
    found.sort(key=lambda limit: -limit.orthogonal_norm)
    effects = [effect_detectability(limit, bench.candidates[limit.effect]) for limit in found]
    return Detectability(effects=tuple(effects), notes=notes)


def _of_axis(runs: Sequence[Any], columns: Sequence[str] | Mapping[str, str]) -> Detectability:
    with threadpool_limits(1):
        found = axis_runs(runs, (), columns=columns)
        limits = axis_limits(found.recipe.logs)
    return Detectability(effects=tuple(limits), notes=found.notes)


def _line(found: EffectDetectability) -> str:
    sizes = ", ".join(_size(found, name) for name in found.smallest_size)
    remark = ", ".join(found.indistinguishable[1:]) or found.needs or ""
    return f"{found.effect:28}{sizes:41} {remark}".rstrip()


def _size(found: EffectDetectability, name: str) -> str:
    size, hidden = found.smallest_size[name], found.hidden_up_to.get(name)
    if size is None and hidden is None:
        return f"{name}: none"
    text = f"{name} {size:.2g}" if size is not None else f"{name} > {hidden:.2g}"
    return f"{text} {found.units[name]}".removesuffix(" 1")
