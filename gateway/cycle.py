"""One tick of the gateway, pure: observation -> supervisor -> regulator -> limits -> command block.

`step` knows no clock and no chance: the same configuration, map and observations give the same
outputs, bit for bit. That is how a recording is replayed.
"""

from dataclasses import dataclass

from gateway.config import Config
from gateway.supervisor import Reason, State, Supervisor
from register_maps.register_map import RegisterMap
from register_maps.signals import Measurement, Setpoint


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What one tick has seen.

    now : monotonic time of the reading [s]
    measurement : the decoded block, None: there is none, and `fault` says why
    fault : what was wrong with this tick's reading or with the write before it
    shadow : never write; stop_requested : SIGTERM, Ctrl-C or the end of the demo
    overruns : deadlines missed in a row up to this tick
    """

    now: float
    measurement: Measurement | None
    fault: Reason | None = None
    shadow: bool = False
    stop_requested: bool = False
    overruns: int = 0


@dataclass(frozen=True, kw_only=True)
class Output:
    """What one tick decided.

    setpoint : the command block to write, None: write nothing
    demand : motor speed that the regulator wants, before the limits [rad/s]; None: no sample yet
    age : of the newest sample [s], None: there was none
    reason : why the last run ended, or why the bench cannot be armed
    """

    setpoint: Setpoint | None
    demand: float | None
    state: State
    reason: Reason | None
    age: float | None


@dataclass(frozen=True, kw_only=True)
class CycleState:
    """All that one tick hands to the next."""

    supervisor: Supervisor


def initial(config: Config, register_map: RegisterMap) -> CycleState:
    """State before the first tick."""
    raise NotImplementedError


def step(
    config: Config, register_map: RegisterMap, state: CycleState, observation: Observation
) -> tuple[CycleState, Output]:
    """One tick."""
    raise NotImplementedError
