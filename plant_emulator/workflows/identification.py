"""The identification as a library call: logs in, parameters with standard errors out."""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time
from typing import TYPE_CHECKING, Any

from plant_emulator.estimation.initial_states import fit_states, states_of, with_logged_values
from plant_emulator.identification import report
from plant_emulator.identification.experiment_design import experiments
from plant_emulator.identification.identify import identify as identify_bench
from plant_emulator.model.stage import split_gap_position
from plant_emulator.parameter_sets import DEFAULT
from plant_emulator.simulation.fit_metrics import LogComparison, compare
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.workflows.arguments import check_reference, list_logs, list_names, list_sources
from plant_emulator.workflows.loading import load_recordings
from plant_emulator.workflows.provenance import log_hash, program_version, today
from plant_emulator.workflows.simulation import effect_values, parameter_set

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from plant_emulator.estimation.start_search import Progress
    from plant_emulator.identification.experiment_design import Experiment
    from plant_emulator.identification.identify import EstimatedParameter, Identification
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.simulation.run_inputs import Hold
    from plant_emulator.workflows.loading import Source
    from plant_emulator.workflows.simulation import Effects


@dataclass(frozen=True, kw_only=True, repr=False)
class IdentificationResult:
    """The result of an identification; `print` shows it as the command `identify` does.

    fit : the estimate with its covariance
    fitted, held_out : every log beside its simulation with the fitted parameters
    experiments : for every parameter that the logs leave open, the program that would tell most
    hashes : SHA-256 of every fitted log, by its name
    notes : what was noticed about the logs, a sentence each
    cpu_seconds : processor time of the fit [s]
    """

    fit: Identification
    fitted: tuple[LogComparison, ...]
    held_out: tuple[LogComparison, ...]
    experiments: tuple[Experiment, ...]
    hashes: Mapping[str, str]
    notes: tuple[str, ...]
    cpu_seconds: float

    @property
    def parameters(self) -> tuple[EstimatedParameter, ...]:
        """The estimated parameters with their standard errors."""
        return self.fit.parameters

    @property
    def converged(self) -> bool:
        """Whether the fit reached a minimum; use the parameters only then."""
        return self.fit.estimate.converged

    @property
    def parameter_set(self) -> ParameterSet:
        """The given set with the estimated values, their standard errors and their origin."""
        return report.parameter_set(self.fit, self.hashes, date=today(), version=program_version())

    def to_json(self) -> dict[str, Any]:
        """The document `identification/1`."""
        return report.to_json(
            self.fit,
            self.fitted,
            self.held_out,
            experiments=self.experiments,
            notes=self.notes,
            cpu_seconds=self.cpu_seconds,
        )

    def to_text(self) -> str:
        """Values, standard errors, open parameters and the fit of every log, as lines."""
        rows = report.lines(self.fit, self.fitted, self.held_out, self.experiments)
        return "\n".join(rows)

    def to_csv(self) -> str:
        """The parameters as CSV text, a row each."""
        return report.parameter_table(self.fit)

    def plot(self, path: str | Path) -> None:
        """Plot every log beside its simulation to a file: PNG, SVG or PDF by its suffix.

        Raises InputError where the file cannot be written, ValueError for another suffix.
        """
        from plant_emulator.workflows.validation_plot import draw_validation

        draw_validation([(c.measured, c.simulated) for c in (*self.fitted, *self.held_out)], path)

    def __str__(self) -> str:
        return self.to_text()

    def __repr__(self) -> str:
        found = [p.name for p in self.parameters if p.identifiable]
        state = "" if self.converged else "; not converged"
        return (
            f"<IdentificationResult: {len(found)} of {len(self.parameters)} parameters determined "
            f"by {len(self.fitted)} logs; residual {self.fit.chi_squared**0.5:.2f} times the noise"
            f"{state}>"
        )


def identify(
    logs: Source | Sequence[Source],
    *,
    parameters: ParameterSet | str | Path = DEFAULT,
    free: str | Sequence[str] = (),
    hold_out: Source | Sequence[Source] = (),
    effects: Effects | Sequence[str] = (),
    reference: Hold | None = None,
    progress: Progress | None = None,
) -> IdentificationResult:
    """Estimate parameters of the bench from its logs, all at once, and predict further logs.

    logs : logs, or the paths of their files, all of one bench
    parameters : the set that the fit starts from and that holds the priors: a parameter set, the
        name of a shipped one, or the path of its file
    free : names of the parameters to estimate; without any, all that the set calls estimated but
        gear_inertia, and with a logged voltage armature_resistance and flux_constant as well; of
        trucks alone whose torque nobody measured, nothing of gear friction and drum
    hold_out : logs to predict; only their initial states are fitted
    effects : effects that the bench is known to have, with given sizes; as for `simulate`
    reference : what holds between samples of the speed reference; None: as the log says
    progress : function that is called with a step's name and its done share, 0 to 1
    Raises InputError for a log, a set, an effect or a name that cannot be used.
    """
    logs, hold_out, free = list_logs(logs), list_sources(hold_out), list_names(free)
    check_reference(reference)
    bench, own = parameter_set(parameters), effect_values(effects)
    recordings, notes = load_recordings([*logs, *hold_out], bench, reference, fitted=len(logs))
    recordings = [with_logged_values(r, own) for r in recordings]
    estimation, prediction = recordings[: len(logs)], recordings[len(logs) :]
    simulate(estimation[0].inputs, values_of(bench, own))  # compiling is not part of the fit's time
    begin = process_time()
    found = identify_bench(estimation, bench, free, effects=own, progress=progress)
    spent = process_time() - begin
    values, states = values_of(found.parameter_set, own), states_of(own)
    names = report.distinct([r.log.source for r in estimation])
    return IdentificationResult(
        fit=found,
        fitted=tuple(_compare(r, values, s) for r, s in zip(estimation, found.states, strict=True)),
        held_out=tuple(_compare(r, values, fit_states(r, values, states)) for r in prediction),
        experiments=tuple(experiments(found, estimation, values)),
        hashes=dict(zip(names, map(log_hash, logs), strict=True)),
        notes=tuple(notes),
        cpu_seconds=spent,
    )


def _compare(
    recording: Recording, values: Mapping[str, float], states: Mapping[str, float]
) -> LogComparison:
    """A log beside its simulation; states : initial states of the run, by name."""
    own, gap = split_gap_position({**values, **recording.logged_values, **states})
    return compare(recording.log, simulate(recording.inputs, own, gap_position=gap))
