"""Speed and power of an axis, and whether its values can be in the unit of their column.

A position in degrees under `position_rad` shows in two ways: the steps of its encoder divide 360
evenly, not 2 pi, and the axis turns faster than motors do. A torque in mN m gives a power that few
axes have, or at least that of a machine of a hundred watts and more, which a note then doubts. A
user who names the unit with the column has the last word.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of axis: its units, those they are mistaken for, and what such an axis hardly reaches.

    doubtful_speed, refused_speed : [SI]; servo motors turn at 300 to 600 rad/s, few at up to
        1000 rad/s (9550 rpm); linear motors move at up to 20 m/s
    refused_power : [W]; a drive of 5 kW is the largest of many series
    """

    position: str
    velocity: str
    force: str
    other_position: str
    other_velocity: str
    other_force: str
    doubtful_speed: float
    refused_speed: float
    refused_power: float


KINDS = {
    True: Kind(
        position="rad",
        velocity="rad/s",
        force="Nm",
        other_position="deg",
        other_velocity="rpm",
        other_force="mNm",
        doubtful_speed=600.0,
        refused_speed=1200.0,
        refused_power=5e3,
    ),
    False: Kind(
        position="m",
        velocity="m/s",
        force="N",
        other_position="mm",
        other_velocity="mm/s",
        other_force="mN",
        doubtful_speed=10.0,
        refused_speed=50.0,
        refused_power=2e4,
    ),
}
TURN = 2.0 * np.pi
# In thousandths of the unit, this power [W] is that of the smallest drives with an encoder.
DOUBTFUL_POWER = 100.0
# Speed and power are means over this share of the run, and so many samples at least.
MEAN_SHARE, FEWEST_MEAN_SAMPLES = 1.0 / 500.0, 5
# Between two samples [s]: slower logs say nothing of the motion of an axis, and one of 1 kHz whose
# time is in ms has a period of 1.
LONGEST_PERIOD = 0.5
# Counts a revolution of encoders.
COUNTS = (
    *(2**k for k in range(6, 25)),
    *(c * 10**k for c in (1, 2, 2.5, 4, 5, 8) for k in range(2, 6)),
)
# A lattice counts with so many different values; how well values stand on it, 0 to 1.
FEWEST_STEPS, CLEAR, UNCLEAR = 20, 0.8, 0.4
DECIMAL = 1e-6


def magnitude_note(logs: Sequence[AxisLog]) -> str:
    """Largest travel, speed and power of the runs in words, with a question where in doubt."""
    kind, rotary = KINDS[logs[0].rotary], logs[0].rotary
    travel = max(float(np.ptp(log.position)) for log in logs)
    speed, power = (max(values) for values in zip(*map(_largest, logs), strict=True))
    moves = f"{travel:.3g} {kind.position}" + (f" ({travel / TURN:.3g} rev)" if rotary else "")
    fast = f"{speed:.3g} {kind.velocity}" + (f" ({60 * speed / TURN:.3g} rpm)" if rotary else "")
    other = kind.other_position if logs[0].velocity is None else kind.other_velocity
    if speed > kind.doubtful_speed:
        fast += f", which is much: are the values in {other}?"
    strong = f"{power:.3g} W"
    if power > DOUBTFUL_POWER and not all("force" in log.confirmed for log in logs):
        strong += (
            f", or {power / 1e3:.3g} W if the values are in {kind.other_force}: "
            f"--column force=COLUMN:{kind.force} or :{kind.other_force} tells which"
        )
    return f"the axis moves over up to {moves}, at up to {fast}, with up to {strong}"


def check_magnitudes(log: AxisLog, columns: Mapping[str, str]) -> None:
    """Raise LogError where values are hardly in the unit of their column.

    columns : names of the columns by quantity, those only whose unit nobody confirmed
    """
    period = float(np.median(np.diff(log.time)))
    if period > LONGEST_PERIOD:
        raise LogError(
            f"{log.source}: a sample every {period:.3g} s, and an axis moves within less than "
            f"{LONGEST_PERIOD:g} s; if the time is in ms, give --column time=COLUMN:ms"
        )
    kind, (speed, power) = KINDS[log.rotary], _largest(log)
    if log.rotary and "position" in columns and counts_degrees(log.position):
        column = columns["position"]
        raise LogError(
            f"{log.source}: column {column}: the steps of its encoder divide 360 and not 2 pi, as "
            f"degrees do; {_way_out('position', column, 'deg', 'rad')}"
        )
    for name, own, other in (
        ("position", kind.position, kind.other_position),
        ("velocity", kind.velocity, kind.other_velocity),
    ):
        if name in columns and speed > kind.refused_speed:
            raise LogError(
                f"{log.source}: column {columns[name]}: the axis would move at {speed:.3g} "
                f"{kind.velocity}, so it is hardly in {own} but perhaps in {other}; "
                f"{_way_out(name, columns[name], other, own)}"
            )
    if "force" in columns and power > kind.refused_power:
        column = columns["force"]
        raise LogError(
            f"{log.source}: column {column}: the axis would take {power / 1e3:.3g} kW, so it is "
            f"hardly in {kind.force} but perhaps in {kind.other_force}; "
            f"{_way_out('force', column, kind.other_force, kind.force)}"
        )


def _way_out(quantity: str, column: str, other: str, own: str) -> str:
    return f"give --column {quantity}={column}:{other}, or :{own} if that is right"


def _largest(log: AxisLog) -> tuple[float, float]:
    """Largest speed and power [SI] of spans that are too long for the noise of single samples."""
    span = max(FEWEST_MEAN_SAMPLES, round(MEAN_SHARE * len(log.time)))
    ends = np.arange(0, len(log.time), span)
    if len(ends) < 2:
        return 0.0, 0.0
    velocity = np.diff(log.position[ends]) / np.diff(log.time[ends])
    force = np.add.reduceat(log.force, ends)[:-1] / np.diff(ends)
    return float(np.abs(velocity).max()), float(np.abs(force * velocity).max())


def counts_degrees(position: Array) -> bool:
    """Whether positions [rad] stand on the lattice of an encoder that divides 360 and not 2 pi."""
    values = np.unique(position)
    return _on_lattice(values, 360.0) > CLEAR and _on_lattice(values, TURN) < UNCLEAR


def _on_lattice(values: Array, revolution: float) -> float:
    """Agreement of values with the lattice of an encoder: 1 for all, 0 for none."""
    best = 0.0
    for counts in COUNTS:
        step = revolution / counts
        if np.ptp(values) < FEWEST_STEPS * step or len(values) < FEWEST_STEPS:
            continue
        if _is_decimal(step):
            continue
        best = max(best, float(np.abs(np.exp(2j * np.pi * values / step).mean())))
    return best


def _is_decimal(step: float) -> bool:
    """Whether a step is that of a rounded number, as a file writes it: 1, 2 or 5 with zeros."""
    mantissa = step / 10.0 ** np.floor(np.log10(step) + DECIMAL)
    return bool(np.min(np.abs(mantissa - np.array([1.0, 2.0, 5.0, 10.0]))) < DECIMAL)
