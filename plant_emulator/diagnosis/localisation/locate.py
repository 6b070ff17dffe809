"""Where the gap lies, without any hypothesis of its cause.

Every block is judged by what it must do with MEASURED signals at its borders: motor, gear with
drum, and drive by relations that need no simulation (`relations`), gap, shaft and drum by a
simulation driven by the measured motor speed (`drum_side`). Each block in turn may then hold an
unknown law of its own quantities (`laws`), next to all parameters that drift, and the block is
asked how much more probable that makes all measurements (`evidence`). The pattern tells them apart:

    torque sensor          motor's and gear's relation, with opposite sign
    motor / gear / drive   that relation alone; where the voltage is logged, motor and drive the
                           armature's too
    drum                   the gear's relation, and the drum's speed in the gap and at contact
    drum's speed sensor    the drum's speed, also while gear and drum touch
    gap and shaft          the drum's speed only after a flight through the gap
    wheel on the drum      the gear's relation, in runs with a truck only

The best block is taken and the rest asked again, until nothing is gained. A step's gain of log
probability is divided among the blocks that could have had it; its shares are the answer's. The
damping of the motor's shaft moves no signal of this bench between two samples: it gets no share.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import Location
from plant_emulator.diagnosis.localisation.block_regression import Site
from plant_emulator.diagnosis.localisation.residual_map import residual_map
from plant_emulator.model.stage import GAP_POSITION

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# Gain of log probability that is worth a block: odds of e^15 before it is believed.
WORTHWHILE_BLOCK_GAIN = 15.0
# The laws are approximate: a difference of this share of the gain is no difference.
APPROXIMATE = 0.02
MOST_BLOCKS = 3
SILENT = "motor_shaft"


def locate(recordings: Sequence[Recording], parameters: ParameterSet, null: FitResult) -> Location:
    """Where the gap of these runs lies.

    null : the converged fit of all that drifts, without effects
    """
    from threadpoolctl import threadpool_limits

    # Threads that wait for each other in decompositions of some hundred columns take ten times
    # as long as one.
    with threadpool_limits(1):
        site = Site(recordings, parameters, null)
        shares, gain = divide(site)
    residuals = [
        recording.residual(site.fitted, state[GAP_POSITION])
        for recording, state in zip(recordings, null.states, strict=True)
    ]
    cells = residual_map(recordings, residuals, site.base_speed)
    widest = max((c for c in cells if c.axis == "phase"), key=lambda c: c.gap / c.noise)
    return Location(
        subsystem=max(shares, key=shares.__getitem__),
        channel=widest.channel,
        phase=widest.bin,
        shares=dict(sorted(shares.items(), key=lambda pair: -pair[1])),
        cells=cells,
        gain=gain,
    )


def divide(site: Site) -> tuple[dict[str, float], float]:
    """Share of every subsystem in the gain of log probability, and that gain."""
    taken: tuple[str, ...] = ()
    before = site.log_evidence(taken)
    credit = dict.fromkeys((*site.blocks, SILENT), 0.0)
    total = 0.0
    for _ in range(MOST_BLOCKS):
        rest = [name for name in site.blocks if name not in taken]
        gains = {name: site.log_evidence((*taken, name)) - before for name in rest}
        best = max(gains, key=gains.__getitem__)
        gain = max(gains[best], 0.0)
        if taken and gain <= WORTHWHILE_BLOCK_GAIN:
            break
        for name, share in among(gains).items():
            credit[name] += max(gain, 1e-9) * share
        total += gain
        taken, before = (*taken, best), before + gains[best]
        if gain <= WORTHWHILE_BLOCK_GAIN:
            break
    whole = sum(credit.values())
    return {name: value / whole for name, value in credit.items()}, total


def among(gains: Mapping[str, float]) -> dict[str, float]:
    """A gain divided among those who could have had it; equal gains, equal shares."""
    values: Array = np.array(list(gains.values()))
    width = 0.5 * WORTHWHILE_BLOCK_GAIN + APPROXIMATE * max(0.0, float(values.max()))
    weight = np.exp((values - values.max()) / width)
    return dict(zip(gains, (weight / weight.sum()).tolist(), strict=True))
