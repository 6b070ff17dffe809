"""The true closed fraction of the gap: the diagnosis's saved model against the noise-free truth.

    1 - sum (rms of truth minus model)^2 / sum ((reference / floor)^2 - 1)

The sums run over the channels that the answer's closed fraction counts. Both are in units of the
noise that the answer tells. The truth has no noise, so no noise is subtracted in the numerator. The
model keeps all its parameters; only its initial states are fitted to each run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.blind.orthogonal_norm import noise_levels
from plant_emulator.estimation.initial_states import fit_states, states_of, with_logged_values
from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.recording import Recording
from plant_emulator.signals.log import COMPARED
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import values_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.answer import Answer
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.signals.log import Array, Log

# A channel counts if its gap is at least so many times the noise floor.
OPEN = 1.1


def true_closed_fraction(answer: Answer, saved: ParameterSet, logs: Sequence[Log]) -> float | None:
    """True closed fraction of the gap [1]; None if the answer has no closed fraction.

    saved : the diagnosis's parameter set, with its effects
    logs : noise-free log of every run
    """
    gap = answer.gap
    if gap.closed_fraction is None:
        return None
    reference = gap.nominal if answer.verdict.kind == "parameter" else gap.recalibrated
    ratios = np.array([reference[name] / gap.noise_floor[name] for name in COMPARED])
    counting = ratios >= OPEN
    residuals = np.concatenate([_residual(log, saved) for log in logs], axis=1)
    squares = np.mean(residuals**2, axis=1) * (noise_levels(COMPARED) / _units(answer, logs)) ** 2
    return 1.0 - float(np.sum(squares[counting]) / np.sum(ratios[counting] ** 2 - 1.0))


def _units(answer: Answer, logs: Sequence[Log]) -> Array:
    """Noise of the answer's gap [SI], shape (channels,).

    The answer tells it over the measured range, which spikes widen, and without the uncertain time
    of the rows. Both are too small there, and the larger counts.
    """
    told = {noise.channel: noise.deviation for noise in answer.noise}
    ranges = {name: np.ptp(np.concatenate([log[name] for log in logs])) for name in COMPARED}
    floor = answer.gap.noise_floor
    return np.array([max(told.get(name, 0.0), floor[name] * ranges[name]) for name in COMPARED])


def _residual(log: Log, saved: ParameterSet) -> Array:
    """Truth minus model over the noise, shape (channels, samples)."""
    use = np.ones((len(COMPARED), len(log.time)), bool)
    bare = Recording(log, inputs_of(log), COMPARED, noise_levels(COMPARED), use)
    recording = with_logged_values(bare, saved.effects)
    values = values_of(saved)
    states = fit_states(recording, values, states_of(saved.effects))
    return recording.residual(*split_gap_position({**values, **recording.logged_values, **states}))
