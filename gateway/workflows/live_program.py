"""A program on the live bench: through supervisor, limits and recorder of the daemon."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import register_maps
from gateway.configuration.config import Config
from gateway.cycle.cycle import Output
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.review.review import review
from gateway.runtime import daemon
from register_maps.register_map import RegisterMap

CONCERNS: Final = ("loop.", "plc.", "limits.watchdog", "regulator.torque")
"""Places of a configuration whose errors also forbid a run without a truck."""
ENDED: Final = (State.RAMPDOWN, State.SAFE)


class Progress:
    """Progress of a program; called with the output of every tick. done : it was completed."""

    done = False

    def __call__(self, output: Output) -> bool:
        """Whether the run is over: the program has come to its end, or the run has ended early."""
        self.done = self.done or output.finished
        return self.done or output.state in ENDED


@dataclass(frozen=True, kw_only=True)
class Ended:
    """The end of a program.

    completed : it came to its end; why : the reason where it did not, empty: it did
    """

    recording: Path
    completed: bool
    why: str


def run_program(config: Config, *, view: bool) -> Ended:
    """Run the program of a configuration on the live bench.

    view : show the run on standard output

    Raises ConfigError for a configuration that does not fit.
    """
    register_map = register_maps.load(config.plc.map)
    _refuse_errors(config, register_map)
    progress = Progress()
    ended = daemon.run(config, register_map, view=view, over=progress)
    why = "stopped by the operator" if ended.reason is None else ended.reason.text
    return Ended(
        recording=ended.recording, completed=progress.done, why="" if progress.done else why
    )


def _refuse_errors(config: Config, register_map: RegisterMap) -> None:
    for one in review(config, register_map).errors:
        if one.where.startswith(CONCERNS):
            raise ConfigError(
                one.what, place=one.where, value=str(one.value), expected=str(one.allowed)
            )
