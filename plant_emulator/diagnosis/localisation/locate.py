"""The fault location: which subsystem holds the gap, without a hypothesis of its cause.

Every block is judged by what it must do with the measured signals at its borders. Motor, gear with
drum, and drive must satisfy parity relations, which need no simulation (`parity_relations`). Gap,
shaft and drum must satisfy a simulation with the measured motor speed (`drum_subsystem`). Each
block in turn may hold unknown laws of its own quantities (`block_basis`) beside the deviations of
all parameters. The marginal likelihood says how much more probable that makes all
measurements (`block_regression`). The pattern tells the blocks apart:

    torque sensor          motor's and gear's relation, with opposite sign
    motor / gear / drive   that relation alone; where the voltage is logged, motor and drive the
                           armature's too
    drum                   the gear's relation, and the drum speed in the gap and at contact
    drum's speed sensor    the drum speed, also while gear and drum touch
    gap and shaft          the drum speed only after a flight through the gap
    wheel on the drum      the gear's relation, in runs with a truck only

The best block is taken and the others are asked again, until nothing is gained. The gain of log
probability of each step is divided among the blocks that could have had it; the shares are the
answer's. The damping of the motor's shaft moves no signal of this bench between two samples, so it
gets no share.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import Location
from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
from plant_emulator.diagnosis.localisation.residual_map import residual_map
from plant_emulator.model.stage import GAP_POSITION

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# A block is believed from this gain of log probability on: odds of e^15.
WORTHWHILE_BLOCK_GAIN = 15.0
# The unknown laws are approximate: a difference of this share of the gain is no difference.
APPROXIMATION = 0.02
# At most so many blocks hold the gap.
MOST_FAULTY_BLOCKS = 3
# No signal shows this subsystem.
SILENT_BLOCK = "motor_shaft"


def locate(recordings: Sequence[Recording], parameters: ParameterSet, null: FitResult) -> Location:
    """Find the subsystem that holds the gap of these runs.

    null : converged fit without effects
    """
    from threadpoolctl import threadpool_limits

    # Several threads take ten times as long as one: in a decomposition of some hundred columns
    # they mostly wait for each other.
    with threadpool_limits(1):
        regression = BlockRegression(recordings, parameters, null)
        shares, gain = divide_gain(regression)
    residuals = [
        recording.residual(regression.fitted, state[GAP_POSITION])
        for recording, state in zip(recordings, null.states, strict=True)
    ]
    cells = residual_map(recordings, residuals, regression.base_speed)
    widest = max((c for c in cells if c.axis == "phase"), key=lambda c: c.gap / c.noise)
    return Location(
        subsystem=max(shares, key=shares.__getitem__),
        channel=widest.channel,
        phase=widest.bin,
        shares=dict(sorted(shares.items(), key=lambda pair: -pair[1])),
        cells=cells,
        gain=gain,
    )


def divide_gain(regression: BlockRegression) -> tuple[dict[str, float], float]:
    """Share of every subsystem in the gain of log probability, and the whole gain [1]."""
    taken: tuple[str, ...] = ()
    before = regression.log_marginal_likelihood(taken)
    credit = dict.fromkeys((*regression.blocks, SILENT_BLOCK), 0.0)
    total = 0.0
    for _ in range(MOST_FAULTY_BLOCKS):
        rest = [name for name in regression.blocks if name not in taken]
        gains = {name: regression.log_marginal_likelihood((*taken, name)) - before for name in rest}
        best = max(gains, key=gains.__getitem__)
        gain = max(gains[best], 0.0)
        if taken and gain <= WORTHWHILE_BLOCK_GAIN:
            break
        for name, share in gain_shares(gains).items():
            credit[name] += max(gain, 1e-9) * share
        total += gain
        taken, before = (*taken, best), before + gains[best]
        if gain <= WORTHWHILE_BLOCK_GAIN:
            break
    whole = sum(credit.values())
    return {name: value / whole for name, value in credit.items()}, total


def gain_shares(gains: Mapping[str, float]) -> dict[str, float]:
    """Divide a gain among the blocks that could have had it; equal gains give equal shares."""
    values: Array = np.array(list(gains.values()))
    width = 0.5 * WORTHWHILE_BLOCK_GAIN + APPROXIMATION * max(0.0, float(values.max()))
    weight = np.exp((values - values.max()) / width)
    return dict(zip(gains, (weight / weight.sum()).tolist(), strict=True))
