"""The validation as a library call: logs in, Val1, Val2 and NRMSD of every channel out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from plant_emulator import logs as log_files
from plant_emulator.identification.report import fit_rows, fit_table, fits_to_json
from plant_emulator.parameter_sets import DEFAULT
from plant_emulator.signals.log import Log
from plant_emulator.simulation.fit_metrics import LogComparison, compare, zero_phase
from plant_emulator.workflows.arguments import check_reference, check_start, list_logs
from plant_emulator.workflows.simulation import effect_values, parameter_set, simulate_log

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.simulation.run_inputs import Hold
    from plant_emulator.workflows.loading import Source
    from plant_emulator.workflows.simulation import Effects, Start

SCHEMA = "validation/1"


@dataclass(frozen=True, kw_only=True, repr=False)
class ValidationResult:
    """Logs beside their simulations; `print` shows the measures as the command `validate` does.

    comparisons : measured and simulated log and the measures of every channel, a log each
    parameter_set : the set that was validated
    """

    comparisons: tuple[LogComparison, ...]
    parameter_set: ParameterSet

    def to_json(self) -> dict[str, Any]:
        """The document `validation/1`."""
        return {"schema": SCHEMA, "logs": fits_to_json(self.comparisons)}

    def to_text(self) -> str:
        """Val1, Val2, NRMSD and rms of every channel of every log, as lines."""
        rows = [row for one in self.comparisons for row in (one.source, *fit_rows(one.fits))]
        return "\n".join(rows)

    def to_csv(self) -> str:
        """The measures as CSV text, a row a channel of a log."""
        return fit_table(self.comparisons)

    def plot(self, path: str | Path) -> None:
        """Plot every log beside its simulation to a file: PNG, SVG or PDF by its suffix.

        Raises InputError where the file cannot be written, ValueError for another suffix.
        """
        from plant_emulator.workflows.validation_plot import draw_validation

        draw_validation([(c.measured, c.simulated) for c in self.comparisons], path)

    def __str__(self) -> str:
        return self.to_text()

    def __repr__(self) -> str:
        val1 = [fit.val1 for one in self.comparisons for fit in one.fits.values()]
        return (
            f"<ValidationResult of {self.parameter_set.name}: {len(self.comparisons)} logs; "
            f"Val1 from {min(val1):.2f} to {max(val1):.2f} %>"
        )


def validate(
    logs: Source | Sequence[Source],
    *,
    parameters: ParameterSet | str | Path = DEFAULT,
    effects: Effects | Sequence[str] = (),
    reference: Hold | None = None,
    start: Start = "fit",
    cutoff: float | None = None,
) -> ValidationResult:
    """Simulate every log under its own inputs and measure how well the simulation follows it.

    logs : logs, or the paths of their files
    parameters, effects, reference, start : as for `simulate`
    cutoff : of a zero-phase low pass through which both go first [Hz]; None: no filter
    Raises InputError for a log, a set or an effect that cannot be used.
    """
    check_reference(reference)
    check_start(start)
    bench, own = parameter_set(parameters), effect_values(effects)
    sources: list[Source] = list_logs(logs)
    measured = [one if isinstance(one, Log) else log_files.read(one) for one in sources]
    pairs = [(log, simulate_log(log, bench, own, reference, start)) for log in measured]
    if cutoff is not None:
        pairs = [(zero_phase(log, cutoff), zero_phase(other, cutoff)) for log, other in pairs]
    return ValidationResult(
        comparisons=tuple(compare(log, simulated) for log, simulated in pairs),
        parameter_set=bench,
    )
