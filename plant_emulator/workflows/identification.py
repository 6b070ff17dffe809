"""From log files to an identified bench: reading, preflight, fit, held-out runs, the answer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any, cast

from plant_emulator import logs
from plant_emulator.errors import IdentificationError
from plant_emulator.estimation.initial_states import fit_states, states_of, with_own
from plant_emulator.identification import report
from plant_emulator.identification.experiment_design import experiments
from plant_emulator.identification.identify import identify
from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.preflight import preflight
from plant_emulator.recordings.recording import recording
from plant_emulator.simulation.fit_metrics import validate
from plant_emulator.simulation.simulate import Hold, simulate, values_of
from plant_emulator.workflows.provenance import file_hash, program_version, today

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.estimation.start_search import Progress
    from plant_emulator.identification.experiment_design import Experiment
    from plant_emulator.identification.identify import Identification
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Log
    from plant_emulator.simulation.fit_metrics import Fit

    Pair = tuple[Log, Log]


@dataclass(frozen=True, kw_only=True)
class Result:
    """An identification with its measures.

    pairs : (measured, simulated) of every log, fitted ones first
    hashes : SHA-256 by log
    """

    found: Identification
    pairs: tuple[Pair, ...]
    fitted: Mapping[str, Mapping[str, Fit]]
    held_out: Mapping[str, Mapping[str, Fit]]
    experiments: tuple[Experiment, ...]
    hashes: Mapping[str, str]
    notes: tuple[str, ...]
    cpu_seconds: float

    def answer(self) -> dict[str, Any]:
        """The machine-readable answer."""
        return report.answer(
            self.found,
            self.fitted,
            self.held_out,
            experiments=self.experiments,
            notes=self.notes,
            cpu_seconds=self.cpu_seconds,
        )

    def lines(self) -> list[str]:
        """The answer for the terminal."""
        return report.lines(self.found, self.fitted, self.held_out, self.experiments)

    def parameter_set(self) -> ParameterSet:
        """The set to save."""
        return report.parameter_set(
            self.found,
            {log: self.hashes[log] for log in self.fitted},
            date=today(),
            version=program_version(),
        )


def identified(
    paths: Sequence[str],
    held_out: Sequence[str],
    parameters: ParameterSet,
    free: Sequence[str],
    *,
    effects: Mapping[str, Mapping[str, float]],
    hold: str | None = None,
    progress: Progress | None = None,
) -> Result:
    """Fit the logs of `paths`, predict those of `held_out`.

    hold : as the option --reference; effects : those that the bench is known to have
    """
    hashes = _hashes([*paths, *held_out])
    estimation, notes = _load(paths, parameters, hold)
    prediction, more = _load(held_out, parameters, hold)
    _different([*estimation, *prediction])
    estimation = [with_own(r, effects) for r in estimation]
    prediction = [with_own(r, effects) for r in prediction]
    given = values_of(parameters, effects)
    simulate(estimation[0].inputs, given)  # compiling is not part of the fit's time
    begin = process_time()
    found = identify(estimation, parameters, free, effects=effects, progress=progress)
    spent = process_time() - begin
    values = values_of(found.parameter_set, effects)
    states = states_of(effects)
    fitted = [_simulated(r, values, s) for r, s in zip(estimation, found.states, strict=True)]
    predicted = [_simulated(r, values, fit_states(r, values, states)) for r in prediction]
    return Result(
        found=found,
        pairs=(*fitted, *predicted),
        fitted={log.source: validate(log, simulated) for log, simulated in fitted},
        held_out={log.source: validate(log, simulated) for log, simulated in predicted},
        experiments=tuple(experiments(found, estimation, values)),
        hashes=hashes,
        notes=(*notes, *more),
        cpu_seconds=spent,
    )


def _simulated(
    recording: Recording, values: Mapping[str, float], states: Mapping[str, float]
) -> Pair:
    """A run as measured and as simulated."""
    own, gap = split_gap_position({**values, **recording.own, **states})
    return recording.log, simulate(recording.inputs, own, gap_position=gap)


def _hashes(paths: Sequence[str]) -> dict[str, str]:
    """SHA-256 of every file; IdentificationError where two are the same run."""
    found: dict[str, str] = {}
    for path in paths:
        if not Path(path).is_file():
            logs.read(path)  # says what is wrong
        digest = file_hash(path)
        for other, known in found.items():
            if digest == known:
                raise IdentificationError(f"{path}: the same run as {other}; give every run once")
        found[path] = digest
    return found


def _different(recordings: Sequence[Recording]) -> None:
    """Refuse the same run in two forms: its samples tell, whatever file holds them."""
    seen: dict[bytes, str] = {}
    for log in (r.log for r in recordings):
        key = log.time.tobytes() + log["motor_speed"].tobytes()
        if key in seen:
            raise IdentificationError(
                f"{log.source}: the same run as {seen[key]}; give every run once"
            )
        seen[key] = log.source


def _load(
    paths: Sequence[str], parameters: ParameterSet, hold: str | None
) -> tuple[list[Recording], list[str]]:
    """Logs ready to be fitted, and what the user should know of them."""
    recordings: list[Recording] = []
    notes: list[str] = []
    for path in paths:
        log = logs.read(path)
        checked = preflight(log, parameters.value("gear_ratio"))
        recordings.append(recording(log, cast("Hold | None", hold), checked.use))
        notes += checked.notes
    return recordings, notes
