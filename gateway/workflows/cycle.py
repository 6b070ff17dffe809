"""A travel cycle in a TOML file, whose legs are recordings of runs in road load.

    name = "yard, two pallets"
    payload_kg = 1600
    cycles_per_hour = 60
    efficiency_percent = 75        # battery to wheel
    recuperation_percent = 30      # braking work at the wheel that returns into the battery

    [[leg]]
    recording = "loaded.rlrec"     # beside this file
    direction = "forward"          # reverse: the bench has driven it forward
    count = 1

    [[auxiliary]]
    what = "lift to 2 m"
    energy_kJ = 35
    count = 2

No key has a default: none would be that of a standard.
"""

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gateway.errors import ConfigError
from gateway.offline.recording_replay import observations
from gateway.offline.travel_cycle import FORWARD, REVERSE, Auxiliary, Leg, TravelCycle, work
from gateway.offline.truck_torque import truck_torques
from gateway.recordings import recording
from gateway.recordings.header import config_of, map_of

NUMBERS = ("payload_kg", "cycles_per_hour", "efficiency_percent", "recuperation_percent")


def travel_cycle(path: Path) -> TravelCycle:
    """Travel cycle of a file. Raises ConfigError with file and key."""
    table = _table(path)
    _refuse_keys(path, table, {"name", "leg", "auxiliary", *NUMBERS})
    payload, rate, efficiency, recuperation = (_number(path, table, key) for key in NUMBERS)
    for key, value in (("cycles_per_hour", rate), ("efficiency_percent", efficiency)):
        if value == 0.0:
            raise _bad(path, key, value, "more than 0")
    for key, value in (("efficiency_percent", efficiency), ("recuperation_percent", recuperation)):
        if value > 100.0:
            raise _bad(path, key, value, "at most 100")
    legs = _entries(path, table, "leg")
    if not legs:
        raise ConfigError("no leg", file=path, expected="[[leg]] with recording, direction, count")
    found = TravelCycle(
        name=_text(path, table, "name"),
        payload=payload,
        cycles_per_hour=rate,
        efficiency=0.01 * efficiency,
        recuperation=0.01 * recuperation,
        legs=tuple(_leg(path, one) for one in legs),
        auxiliaries=tuple(_auxiliary(path, one) for one in _entries(path, table, "auxiliary")),
    )
    if found.power <= 0.0:
        raise ConfigError("no energy is taken", file=path, expected="legs that drive the truck")
    return found


def _table(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text("utf-8"))
    except (ValueError, RecursionError) as error:  # no TOML or UTF-8
        raise ConfigError(str(error), file=path, expected="a travel cycle (TOML)") from error


def _leg(path: Path, entry: Mapping[str, Any]) -> Leg:
    """Leg of an entry, measured from its recording."""
    _refuse_keys(path, entry, {"recording", "direction", "count"})
    direction = _text(path, entry, "direction")
    if direction not in (FORWARD, REVERSE):
        raise _bad(path, "direction", direction, f"{FORWARD} or {REVERSE}")
    found = recording.read(path.parent / _text(path, entry, "recording"))
    config, register_map = config_of(found.header), map_of(found.header)
    seen = observations(found.rows(), register_map)
    torques = truck_torques(seen, found.records["state"], config, register_map)
    measured = work(torques, config.bench.drum_radius)
    if config.program is not None or not measured["distance"]:
        raise ConfigError(
            "no truck moved", file=found.path, expected="a recording of a truck in road load"
        )
    return Leg(
        name=found.path.name,
        mass=config.truck.total_mass,
        count=_count(path, entry),
        direction=direction,
        **measured,
    )


def _auxiliary(path: Path, entry: Mapping[str, Any]) -> Auxiliary:
    _refuse_keys(path, entry, {"what", "energy_kJ", "count"})
    energy = 1e3 * _number(path, entry, "energy_kJ")
    return Auxiliary(what=_text(path, entry, "what"), energy=energy, count=_count(path, entry))


def _entries(path: Path, table: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    found = table.get(key, [])
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        raise ConfigError("not a list of tables", file=path, place=key, expected=f"[[{key}]]")
    return found


def _refuse_keys(path: Path, table: Mapping[str, Any], known: set[str]) -> None:
    for key in table:
        if key not in known:
            expected = ", ".join(sorted(known))
            raise ConfigError("unknown key", file=path, value=key, expected=expected)


def _number(path: Path, table: Mapping[str, Any], key: str) -> float:
    value = table.get(key)
    if (
        not isinstance(value, (int, float))
        or isinstance(value, bool)
        or not math.isfinite(value)
        or value < 0.0
    ):
        raise _bad(path, key, value, "a number of at least 0")
    return float(value)


def _count(path: Path, table: Mapping[str, Any]) -> int:
    value = table.get("count")
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        raise _bad(path, "count", value, "1 or more")
    return value


def _text(path: Path, table: Mapping[str, Any], key: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise _bad(path, key, value, "a text of one line")
    return value


def _bad(path: Path, key: str, value: object, expected: str) -> ConfigError:
    return ConfigError("bad value", file=path, place=key, value=value, expected=expected)
