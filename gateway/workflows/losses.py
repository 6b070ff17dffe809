"""The measurement of the bench's friction: from files, or by a sweep on the live bench."""

from collections.abc import Callable, Sequence
from pathlib import Path

from gateway.configuration.config import Config
from gateway.errors import GatewayError
from gateway.losses.fit import FrictionFit, fit
from gateway.losses.live import sweep_config
from gateway.losses.result import Losses, Source
from gateway.losses.sections import LeftOut, LossesError, Section, steady
from gateway.recordings import steady_runs
from gateway.workflows.live_program import run_program


def measure_losses(files: Sequence[Path], config: Config | None = None) -> Losses:
    """Friction of the bench from the steady stretches of logs and recordings.

    config : configuration of the bench; default: that of each recording, for a log the defaults of
        the gateway

    Raises LossesError where the runs do not determine the friction.
    """
    sections: list[Section] = []
    left_out: list[LeftOut] = []
    sources: list[Source] = []
    for run in map(steady_runs.read, files):
        known = config or run.config or Config()
        try:
            found = steady(run.trace, known.bench, known.regulator)
        except LossesError as error:
            raise LossesError(f"{run.path}: {error}") from error
        sections += found.sections
        left_out += found.left_out
        sources.append(Source(file=run.path.name, date=run.date, sha256=run.sha256))
    return Losses(
        fit=_fit(files, sections, left_out),
        sections=sections,
        left_out=left_out,
        sources=sources,
        bench=known.bench,
    )


def _fit(files: Sequence[Path], sections: list[Section], left_out: list[LeftOut]) -> FrictionFit:
    """The friction law; its error names the files, and why stretches were left out."""
    try:
        return fit(sections)
    except LossesError as error:
        why = "".join(f"; left out: {one.why}" for one in left_out)
        names = ", ".join(str(path) for path in files)
        raise LossesError(f"{names}: {error}{why}") from error


def run_sweep(
    config: Config,
    *,
    speeds: Sequence[float] | None = None,
    hold: float | None = None,
    view: bool = True,
    report: Callable[[str], None],
) -> Path:
    """Hold steady speeds on the live bench; return the path of the recording.

    speeds : of the motor [rpm], default: 200 .. 4500 rpm; hold : each for so long [s], default: 8
    view : show the run on standard output; report : takes lines for the operator

    Raises ConfigError for speeds or a configuration that do not fit, GatewayError where the sweep
    did not come to its end.
    """
    swept = sweep_config(config, speeds, hold)
    assert swept.program is not None
    report(
        f"no truck on the drum; {len(swept.program.steps) - 1} speeds, "
        f"{swept.program.duration:.0f} s from the moment in which the PLC is switched to remote"
    )
    ended = run_program(swept, view=view)
    report(f"recording: {ended.recording}")
    if not ended.completed:
        raise GatewayError(f"the sweep did not come to its end: {ended.why}; see {ended.recording}")
    return ended.recording
