"""How far the gap really shrinks: the saved model against the noise-free truth.

    1 - sum (rms of truth minus model)^2 / sum ((reference / floor)^2 - 1)

over the channels that count in the answer's closed fraction, both in units of the noise. The truth
has no noise, so that nothing has to be taken off; the model keeps all its values and only its start
states are fitted to each run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.blind.detectable import noise_levels
from plant_emulator.estimation.initial_states import fit_states, states_of, with_own
from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.recording import Recording
from plant_emulator.signals.log import COMPARED
from plant_emulator.simulation.simulate import run_of, values_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.signals.log import Array, Log

# A channel counts from this gap on, in the noise.
OPEN = 1.1


def true_closed_fraction(
    answer: Mapping[str, Any], saved: ParameterSet, logs: Sequence[Log]
) -> float | None:
    """The true share of the gap that is closed; None where the answer tells none.

    saved : the parameter set of the diagnosis, with its effects; logs : the true ones
    """
    gap = answer["gap"]
    if gap["closed_fraction"] is None:
        return None
    reference = gap["nominal" if answer["verdict"]["kind"] == "parameter" else "recalibrated"]
    ratios = np.array([reference[name] / gap["noise_floor"][name] for name in COMPARED])
    counting = ratios >= OPEN
    left = np.concatenate([_left(log, saved) for log in logs], axis=1)
    squares = np.mean(left**2, axis=1)
    return 1.0 - float(np.sum(squares[counting]) / np.sum(ratios[counting] ** 2 - 1.0))


def _left(log: Log, saved: ParameterSet) -> Array:
    """Truth minus model over the noise, shape (channels, samples)."""
    use = np.ones((len(COMPARED), len(log.time)), bool)
    bare = Recording(log, run_of(log), COMPARED, noise_levels(COMPARED), use)
    recording = with_own(bare, saved.effects)
    values = values_of(saved)
    states = fit_states(recording, values, states_of(saved.effects))
    return recording.residual(*split_gap_position({**values, **recording.own, **states}))
