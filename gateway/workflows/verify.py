"""The verification of the emulated road: a run on the live bench, and its evaluation."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gateway.commissioning.check import Check, page
from gateway.commissioning.checks import torque
from gateway.commissioning.verification import (
    CHECKS,
    REPEATS,
    evaluate,
    verification_program,
)
from gateway.configuration.config import Config
from gateway.errors import ConfigError, GatewayError
from gateway.recordings import step_runs
from gateway.workflows.live_program import run_program

SCALE_FIRST: Final = "the torque first: losses, inertia and coast-downs are measured by it"


@dataclass(frozen=True, kw_only=True)
class Verification:
    """Values of the checks, and the recording that they come from."""

    checks: tuple[Check, ...]
    recording: Path

    @property
    def holds(self) -> bool:
        """Whether every value lies within its limit."""
        return all(one.holds for one in self.checks)

    def to_json(self) -> dict[str, Any]:
        """Return the verification as the document verification-of-road/1."""
        return {
            "schema": "verification-of-road/1",
            "holds": self.holds,
            "checks": [one.to_json() for one in self.checks],
            "recording": str(self.recording),
            "sha256": hashlib.sha256(self.recording.read_bytes()).hexdigest(),
        }

    def __str__(self) -> str:
        scale = next((one for one in self.checks if one.name == torque.NAME), None)
        hint = "" if scale is None or scale.holds else f"\n{SCALE_FIRST}"
        return page(self.checks) + hint


def verify(
    config: Config,
    *,
    only: Sequence[str] = (),
    repeats: int = REPEATS,
    view: bool = True,
    report: Callable[[str], None],
) -> Verification:
    """Verify the emulated road on the live bench, without a truck on the drum.

    only : names of checks, default: all
    repeats : of the runs up and down, and of the coast-downs, these 2 to 4 times
    view : show the run on standard output; report : takes lines for the operator

    Raises ConfigError for a configuration that does not fit, GatewayError where the run did not
    come to its end.
    """
    names = [name for name in CHECKS if not only or name in only]
    program = verification_program(config, names, repeats)
    report(
        f"no truck on the drum; {', '.join(names)}: at most {program.duration / 60.0:.0f} min from "
        "the moment in which the PLC is switched to remote"
    )
    ended = run_program(config.with_program(program), view=view)
    report(f"recording: {ended.recording}")
    if not ended.completed:
        raise GatewayError(
            f"the verification did not come to its end: {ended.why}; see {ended.recording}"
        )
    return evaluate_recording(ended.recording, names)


def evaluate_recording(path: Path, names: Sequence[str] = ()) -> Verification:
    """Evaluate the recording of a verification again.

    names : of checks, default: those whose steps the recording has

    Raises ConfigError for the recording of another run, which has no steps of a check.
    """
    run = step_runs.read(path)
    known = [name for name, check in CHECKS.items() if any(run.parts(check.LABEL))]
    if not known:
        assert run.config.program is not None
        raise ConfigError(
            f"the run of {run.config.program.name}", file=path, expected="a recording of verify"
        )
    known = list(names or known)
    return Verification(checks=tuple(evaluate(run, known)), recording=path)
