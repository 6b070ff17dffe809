"""The header of a recording: everything that a replay needs besides the records."""

import platform
import tomllib
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import register_maps
from gateway.configuration.config import Config, config_hash, from_document
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps.entry import Lines
from register_maps.parse import parse
from register_maps.register_map import RegisterMap


def header(
    config: Config, register_map: RegisterMap, *, started: float, shadow: bool, real_time: str
) -> dict[str, Any]:
    """Header of a new recording; started : monotonic time of its first tick [s]."""
    return {
        "title": f"gateway: {config.plc.host}:{config.plc.port}, map {register_map.name}",
        "date": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "started": started,
        "shadow": shadow,
        "real_time": real_time,
        "map": register_map.name,
        "map_hash": register_map.source_hash,
        "map_text": map_text(config.plc.map),
        "config": config.document,
        "program": config.program and [config.program.name, config.program.duration],
        "config_hash": config_hash(config),
        "read_count": register_map.measurement.count,
        "write_count": register_map.command.count,
        "states": {str(state.value): state.name for state in State},
        "reasons": {str(reason.value): [reason.name, reason.text] for reason in Reason},
        "versions": {
            "gateway": version("road-load-bench"),
            "pymodbus": version("pymodbus"),
            "python": platform.python_version(),
        },
    }


def map_text(name: str) -> str:
    """Text of a register map, given by its shipped name or its path."""
    shipped = Path(register_maps.__file__).with_name(f"{name}.toml")
    return (shipped if name in register_maps.names() else Path(name)).read_text("utf-8")


def map_of(header: dict[str, Any]) -> RegisterMap:
    """The register map that a recording was made with."""
    text = header["map_text"]
    return parse(
        tomllib.loads(text),
        file=f"{header['map']} in the recording",
        lines=Lines(text),
        source_hash=header["map_hash"],
    )


def config_of(header: dict[str, Any]) -> Config:
    """The configuration that a recording was made with."""
    return from_document(
        header["config"], place=lambda section, key: f"recording: [{section}] {key}"
    )
