"""The diagnosis as a library call: logs in, answer, report and parameter set out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from threadpoolctl import threadpool_limits

from plant_emulator.diagnosis.axis.diagnose import AxisResult, AxisRuns, diagnose_axis
from plant_emulator.diagnosis.diagnose import Diagnose
from plant_emulator.diagnosis.execution.progress import ReportingPool
from plant_emulator.diagnosis.report.document import to_json
from plant_emulator.diagnosis.report.html.page import html
from plant_emulator.diagnosis.report.terminal import lines
from plant_emulator.diagnosis.wording import KINDS, percent
from plant_emulator.errors import InputError, report_unwritable
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.parameter_sets import DEFAULT, with_effects
from plant_emulator.simulation.programs import describe
from plant_emulator.workflows.arguments import (
    check_choice,
    check_count,
    check_reference,
    list_logs,
    list_names,
    list_sources,
)
from plant_emulator.workflows.diagnosis import axis_set
from plant_emulator.workflows.diagnosis.calibration import load_model_form_errors, trial_cases
from plant_emulator.workflows.diagnosis.drafting import Drafted
from plant_emulator.workflows.diagnosis.drafting import draft as draft_law
from plant_emulator.workflows.diagnosis.runs import axis_runs, bench_runs
from plant_emulator.workflows.diagnosis.saved_set import axis_parameter_set, parameter_set
from plant_emulator.workflows.workers import make_pool

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import Answer
    from plant_emulator.diagnosis.diagnose import Findings
    from plant_emulator.diagnosis.execution.pool import Pool
    from plant_emulator.diagnosis.execution.progress import Progress
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.workflows.diagnosis.runs import Runs, Source

# Folder of the effect files of drafts, in the current one.
DRAFTS = "drafts"


@dataclass(frozen=True, kw_only=True, repr=False)
class Diagnosis:
    """The result of a diagnosis; `print` shows it as the command `diagnose` does.

    given : the parameter set that was diagnosed; None: a single axis without one
    fitted : the runs of the bench that were not held out
    effect_files : of the user's own effects, absolute
    drafted : drafts of a missing law, with their fits; None: nobody asked, or it cannot be done
    """

    findings: Findings
    given: ParameterSet | None
    fitted: tuple[Recording, ...]
    effect_files: tuple[str, ...] = ()
    drafted: Drafted | None = None

    @property
    def answer(self) -> Answer:
        """Verdict, location, held-out gap, ranking, and what these logs cannot show."""
        return self.findings.answer

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the logs, a sentence each."""
        return self.findings.details.notes

    @property
    def parameter_set(self) -> ParameterSet:
        """The given set with the fitted values and the accepted effects, or else the best draft.

        The set of a single axis holds its own parameters.
        """
        findings, files = self.findings, {Path(file).stem: file for file in self.effect_files}
        if self.drafted and self.drafted.fits and not self.answer.verdict.effects:
            file, fit = self.drafted.drafts[0].file, self.drafted.fits[0]
            files[Path(file).stem] = file
            findings = replace(findings, final=fit, fixed={Path(file).stem: {}})
            if self.drafted.of_axis:
                answer = replace(self.answer, ranking=self.drafted.of_axis[:1])
                findings = replace(findings, answer=answer)
        if isinstance(findings, AxisResult):
            of_set = {} if self.given is None else self.given.effect_files
            return axis_parameter_set(findings, self.given, {**of_set, **files})
        assert self.given is not None
        return parameter_set(findings, self.given, self.fitted, files)

    def to_json(self) -> dict[str, Any]:
        """The answer as the document `gap-diagnosis/1`."""
        return to_json(self.answer)

    def to_html(self) -> str:
        """The report as one HTML document that needs no network."""
        return html(self.answer, self.findings.details)

    def to_text(self, width: int = 80) -> str:
        """The answer on one screen of 24 lines, each at most `width` characters."""
        return "\n".join(lines(self.answer, width))

    def write_report(self, path: str | Path) -> None:
        """Write the report to an HTML file; InputError where the file cannot be written."""
        with report_unwritable(path):
            Path(path).write_text(self.to_html(), encoding="utf-8")

    def __str__(self) -> str:
        return self.to_text()

    def __repr__(self) -> str:
        verdict, closed = self.answer.verdict, self.answer.gap.closed_fraction
        words = ", ".join([KINDS[verdict.kind], *verdict.effects])
        share = "" if closed is None else f"; {percent(closed)} of the held-out gap closed"
        return f"<Diagnosis: {words}{share}>"


def diagnose(
    logs: Source | Sequence[Source],
    *,
    hold_out: Source | Sequence[Source] = (),
    parameters: ParameterSet | str | Path = DEFAULT,
    model: Literal["bench", "axis"] = "bench",
    without: str | Sequence[str] = (),
    effect_files: str | Path | Sequence[str | Path] = (),
    reference: Literal["linear", "staircase"] | None = None,
    columns: Sequence[str] | Mapping[str, str] = (),
    one_run: bool = False,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    settings: Mapping[str, str] | None = None,
    draft: Literal["never", "unknown", "always"] = "never",
    draft_folder: str | Path = DRAFTS,
) -> Diagnosis:
    """Diagnose the gap between the model and the machine that the logs were recorded on.

    logs : paths of log files, or logs that were read, all of one machine; for an axis also a part
        in time of a file, FILE@12.5:20 [s]
    hold_out : logs to predict; without any, every log is held out in turn
    parameters : a parameter set, the name of a shipped one, or the path of its file; of an axis
        only one that a diagnosis saved
    model : the roller bench, or a single motor-driven axis
    without : names of effects to take out of the library
    effect_files : files of your own effects beside the library
    reference : what holds between samples of the speed reference; None: as the log says
    columns : of the files of an axis, as {"position": "enc:deg", "force": "iq*0.40:Nm"}
    one_run : whether the logs of an axis are parts of one run; its last part is predicted if no
        log is held out, and nothing is compared over the joints
    workers : processes that fit side by side; more than one needs `if __name__ == "__main__":`
        in a script, because every process imports it
    scheduler : address of a Dask scheduler to use in their place, tcp://host:port
    progress : function that is called with a step's name and its done share, 0 to 1
    settings : lines for the report, by name, on how to repeat the diagnosis
    draft : whether a missing law is drafted: where the cause is unknown, or always
    draft_folder : folder of the effect files of the drafts
    Raises InputError for a log, a set or an option that cannot be used, and EmulatorError where
    a worker is lost.
    """
    logs, hold_out, without = list_logs(logs), list_sources(hold_out), list_names(without)
    effect_files = list_sources(effect_files)
    check_choice("model", model, ("bench", "axis"))
    check_reference(reference)
    check_count("workers", workers, 1)
    if model == "bench" and (columns or one_run):
        raise InputError("columns and one_run belong to the model axis")
    runs: Runs[Any]
    if model == "axis":
        given = _axis_set(parameters)
        runs = axis_runs(
            logs,
            hold_out,
            without=without,
            effect_files=effect_files,
            columns=columns,
            one_run=one_run,
            parameters=given,
        )
    else:
        given = _set(parameters, effect_files)
        runs = bench_runs(
            logs,
            hold_out,
            given,
            without=without,
            effect_files=effect_files,
            reference=reference,
        )
    pool = make_pool(workers, scheduler)
    try:
        with threadpool_limits(1):
            findings = _findings(runs, pool, settings or {}, progress)
            shown = pool if progress is None else ReportingPool(pool, progress)
            findings, drafted = _with_drafts(findings, runs, shown, draft, Path(draft_folder))
    finally:
        pool.close()
    findings = replace(findings, details=replace(findings.details, inputs=runs.inputs))
    return Diagnosis(
        findings=findings,
        given=given,
        fitted=runs.fitted,
        effect_files=tuple(str(Path(file).absolute()) for file in effect_files),
        drafted=drafted,
    )


def _findings(
    runs: Runs[Any], pool: Pool, settings: Mapping[str, str], progress: Progress | None
) -> Findings:
    """Diagnose the bench, or an axis, which needs no other processes."""
    told = {**settings, **runs.settings}
    if isinstance(runs.recipe, AxisRuns):
        return diagnose_axis(
            runs.recipe, runs.plan, settings=told, notes=runs.notes, progress=progress
        )
    return Diagnose(
        pool,
        runs.recipe,
        runs.plan,
        settings=told,
        cases=trial_cases(),
        model_form_errors=load_model_form_errors(),
        notes=runs.notes,
        progress=progress,
    ).diagnose()


def _with_drafts(
    findings: Findings, runs: Runs[Any], pool: Pool, wanted: str, folder: Path
) -> tuple[Findings, Drafted | None]:
    """The findings with the drafts of a missing law, if these are wanted."""
    verdict = findings.answer.verdict
    if wanted == "never" or (wanted == "unknown" and verdict.kind != "unknown"):
        return findings, None
    null = None if findings.final.effects else findings.final
    try:
        drafted = draft_law(runs, null, pool, folder)
    except InputError as error:
        if wanted == "always":
            raise
        told = (*findings.details.notes, f"no missing law is drafted: {error}")
        return replace(findings, details=replace(findings.details, notes=told)), None
    if drafted is None:
        return findings, None
    if drafted.next_program is not None:
        names = " from ".join(Path(one.file).stem for one in drafted.drafts[:2])
        advised = f"drive {describe(drafted.next_program)}: it separates {names}"
        verdict = replace(verdict, next_experiment=advised)
    answer = replace(findings.answer, verdict=verdict, drafts=drafted.drafts)
    notes = findings.details.notes
    if drafted.bound is not None and not drafted.drafts:
        limit = percent(drafted.bound.interval[1])
        notes = (
            *notes,
            f"no missing law is drafted: no law that was tried closes more than {limit}",
        )
    details = replace(findings.details, draft_traces=drafted.traces, notes=notes)
    return replace(findings, answer=answer, details=details), drafted


def _set(parameters: ParameterSet | str | Path, effect_files: Sequence[str | Path]) -> ParameterSet:
    if isinstance(parameters, ParameterSet):
        return parameters
    return with_effects.load(parameters, effect_files)


def _axis_set(parameters: ParameterSet | str | Path) -> ParameterSet | None:
    """The set of an axis; None for the default, which is that of the bench."""
    if isinstance(parameters, ParameterSet):
        return parameters
    return None if str(parameters) == DEFAULT else axis_set.load(parameters)
