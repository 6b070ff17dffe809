"""Replay of a recording through the tick (pure).

A recording has every observation of its run, so that `cycle.step` must give every output again, bit
for bit. A difference comes from other parameters, or from a mistake in this software.
"""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from gateway.configuration.config import Config
from gateway.cycle.cycle import Observation, Output, initial, step
from gateway.cycle.record import (
    COMMANDED,
    COMPUTED,
    NOTHING,
    READ,
    SHADOW,
    STOP_REQUESTED,
    number,
    values,
)
from gateway.cycle.supervisor import State
from gateway.reasons import REASONS
from register_maps.codec import CodecError, decode_measurement, encode_setpoint
from register_maps.register_map import RegisterMap
from register_maps.signals import Measurement

Row = dict[str, Any]
"""A tick as recorded: gateway.recordings.recording.Recording.rows()."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """First difference of one tick between recording and replay; time : as recorded [s]."""

    tick: int
    time: float
    what: str
    recorded: object
    replayed: object


def observations(rows: Iterable[Row], register_map: RegisterMap) -> Iterator[Observation]:
    """Observation of each tick of a recording."""
    latency = 0.0
    for row in rows:
        yield Observation(
            now=row["now"],
            measurement=_measurement(row, register_map) if row["flags"] & READ else None,
            fault=REASONS.get(row["fault"]),
            shadow=bool(row["flags"] & SHADOW),
            stop_requested=bool(row["flags"] & STOP_REQUESTED),
            overruns=row["overruns"],
            latency=latency,
        )
        latency = row["latency"]


def _measurement(row: Row, register_map: RegisterMap) -> Measurement | None:
    try:
        return decode_measurement(register_map, row["words_read"])
    except CodecError:
        return None


def outputs(
    config: Config, register_map: RegisterMap, seen: Iterable[Observation]
) -> Iterator[Output]:
    """Output of the tick for each observation."""
    state = initial(config, register_map)
    for observation in seen:
        state, output = step(config, register_map, state, observation)
        yield output


def differences(
    rows: Iterable[Row], replayed: Iterable[Output], register_map: RegisterMap
) -> Iterator[Difference]:
    """Differences of outputs from the recorded ones, bit by bit; the first of each tick."""
    for row, output in zip(rows, replayed, strict=True):
        for what, before, after in _pairs(row, output, register_map):
            if _bits(before) != _bits(after):
                yield Difference(
                    tick=row["tick"],
                    time=row["now"],
                    what=what,
                    recorded=before,
                    replayed=after,
                )
                break


def _pairs(row: Row, output: Output, register_map: RegisterMap) -> Iterator[tuple[str, Any, Any]]:
    """Compared values of one tick: name, recorded, replayed."""
    yield "state", State(row["state"]).name, output.state.name
    yield "reason", row["reason"], NOTHING if output.reason is None else int(output.reason)
    yield "demand", row["demand"], number(output.demand)
    yield "age", row["age"], number(output.age)
    again = values(output.setpoint, COMMANDED)
    for name, value in zip(COMMANDED, again, strict=True):
        yield f"setpoint {name}", row[f"setpoint_{name}"], value
    if row["flags"] & COMPUTED and output.setpoint is not None:
        words = encode_setpoint(register_map, output.setpoint)
        yield "words written", tuple(row["words_written"]), words


def _bits(value: Any) -> Any:
    return struct.pack("<d", value) if isinstance(value, float) else value
