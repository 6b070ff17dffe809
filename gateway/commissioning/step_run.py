"""A run through the steps of a program: its samples, and the step at work in each (pure)."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from gateway.arrays import Array
from gateway.configuration.config import Config
from gateway.configuration.program import Step
from gateway.cycle.cycle import Observation, initial, step
from gateway.cycle.supervisor import State
from gateway.losses.sections import SweepTrace
from register_maps.register_map import RegisterMap

OUTSIDE = -1
"""Step of a sample outside of the run."""


@dataclass(frozen=True, kw_only=True)
class StepRun:
    """Samples of a run in SI, shape (n,) each.

    config : of the run, with its program
    trace : speeds and shaft torque; current : of the armature [A], NaN: unknown
    own_time : by the gateway's clock [s]; heartbeat : scans of the PLC since the first sample
    oil_temperature : of the gear as the gateway computes it [K], NaN: unknown
    steps : index of the step whose demand followed from the sample; OUTSIDE: none
    """

    config: Config
    trace: SweepTrace
    current: Array
    own_time: Array
    heartbeat: Array
    oil_temperature: Array
    steps: NDArray[np.int64]

    @property
    def rim_speed(self) -> Array:
        """Speed of the drum's rim [m/s]."""
        return self.trace.drum_speed * self.config.bench.drum_radius

    def parts(self, label: str) -> Iterator[tuple[Step, slice]]:
        """Steps with this label that have samples, each with its samples."""
        assert self.config.program is not None
        for number, one in enumerate(self.config.program.steps):
            inside = np.flatnonzero(self.steps == number)
            if one.label == label and len(inside):
                yield one, slice(int(inside[0]), int(inside[-1]) + 1)


def replay_steps(
    config: Config, register_map: RegisterMap, seen: Iterable[Observation]
) -> tuple[list[int], list[float], bool]:
    """Step at work, and temperature of the oil [K], in each tick of a run, from its replay.

    Third: whether the program came to its end.
    """
    state, numbers, oil, finished = initial(config, register_map), [], [], False
    for observation in seen:
        before = state.regulator
        state, output = step(config, register_map, state, observation)
        runs = output.state is State.RUN and before is not None
        numbers.append(before.number if runs else OUTSIDE)
        oil.append(nan if state.samples.oil is None else state.samples.oil)
        finished = finished or output.finished
    return numbers, oil, finished
