"""The head of a recording: everything that a replay needs besides the records.

Head = magic, length of the header (4 bytes, little-endian), header (JSON).
"""

import json
import platform
import tomllib
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, cast, get_origin

import register_maps
from gateway.configuration.config import Config, Document, config_hash, from_document
from gateway.cycle.record import MAGIC, NOTHING, Layout
from gateway.cycle.supervisor import State
from gateway.errors import RecordingError
from gateway.reasons import Reason
from register_maps.entry import Lines
from register_maps.parse import parse
from register_maps.register_map import RegisterMap

SCHEMA: Final = "recording/1"
PREFIX: Final = len(MAGIC) + 4
"""[bytes] Magic and length, before the header."""
RENAMED: Final = {("plausibility", "noisy_speeds"): "noisy_sensors"}
"""Keys of older recordings, each by its section, and what the configuration calls them now."""


@dataclass(frozen=True, kw_only=True)
class Header:
    """Header of a recording; the fields are the keys of its JSON, in the order of the file.

    date : of the first tick, ISO 8601, UTC; started : monotonic time of the first tick [s]
    shadow : nothing was written to the PLC; real_time : what the system granted
    map, map_hash, map_text : name of the register map, SHA-256 of its file, and text of its file
    config : sections, keys and values as in a file; config_hash : its SHA-256
    program : name and duration [s]; None: a truck in road load
    read_count, write_count : registers that a record holds
    states, reasons : name of a code, name and text of a code; the code is a text, as JSON asks
    versions : of gateway, pymodbus and Python
    """

    title: str
    date: str
    started: float
    shadow: bool
    real_time: str
    map: str
    map_hash: str
    map_text: str
    config: Document
    program: Sequence[str | float] | None = None
    config_hash: str
    read_count: int
    write_count: int
    states: dict[str, str]
    reasons: dict[str, Sequence[str]]
    versions: dict[str, str]

    @classmethod
    def of(
        cls,
        config: Config,
        register_map: RegisterMap,
        *,
        started: float,
        shadow: bool,
        real_time: str,
    ) -> "Header":
        """Header of a new recording; started : monotonic time of its first tick [s]."""
        program = config.program
        return cls(
            title=f"gateway: {config.plc.host}:{config.plc.port}, map {register_map.name}",
            date=datetime.now(UTC).isoformat(timespec="milliseconds"),
            started=started,
            shadow=shadow,
            real_time=real_time,
            map=register_map.name,
            map_hash=register_map.source_hash,
            map_text=map_text(config.plc.map),
            config=config.document,
            program=None if program is None else (program.name, program.duration),
            config_hash=config_hash(config),
            read_count=register_map.measurement.count,
            write_count=register_map.command.count,
            states={str(state.value): state.name for state in State},
            reasons={str(reason.value): (reason.name, reason.text) for reason in Reason},
            versions={
                "gateway": version("road-load-bench"),
                "pymodbus": version("pymodbus"),
                "python": platform.python_version(),
            },
        )

    @property
    def layout(self) -> Layout:
        """Layout of the records."""
        return Layout(read_count=self.read_count, write_count=self.write_count)

    def state(self, code: int) -> str:
        """Name of a state."""
        return self.states[str(code)]

    def reason(self, code: int) -> str:
        """Name of a reason or fault; empty: none."""
        return self.reasons[str(code)][0] if code != NOTHING else ""

    def encode(self) -> bytes:
        """Head of a recording as the bytes of its file."""
        text = json.dumps({"schema": SCHEMA, **vars(self)}).encode()
        return MAGIC + len(text).to_bytes(4, "little") + text


def decode(path: Path, content: bytes) -> tuple[Header, int]:
    """Header at the beginning of a recording, and the place at which the records begin [bytes].

    Raises RecordingError with the key that is wrong.
    """
    end = PREFIX + length_of(content)
    if not content.startswith(MAGIC) or len(content) < end:
        raise RecordingError(
            "not a recording",
            file=path,
            value=content[: len(MAGIC)],
            expected=f"a file that begins with {MAGIC!r} and a whole header",
        )
    try:
        document = json.loads(content[PREFIX:end])
    except ValueError as error:
        raise RecordingError(str(error), file=path, place="header", expected="JSON") from error
    return _of_document(path, document), end


def length_of(head: bytes) -> int:
    """Length of the header [bytes], told by the bytes before it."""
    return int.from_bytes(head[len(MAGIC) : PREFIX], "little")


def _of_document(path: Path, document: Any) -> Header:
    schema = document.get("schema") if isinstance(document, dict) else document
    if schema != SCHEMA:
        raise RecordingError(
            "unknown format", file=path, place="schema", value=schema, expected=repr(SCHEMA)
        )
    for key in fields(Header):
        value = document.get(key.name)
        kind = cast("type", get_origin(key.type) or key.type)
        # A key with a default is younger than the format: old recordings do not have it.
        if key.default is MISSING and not isinstance(value, kind):
            raise RecordingError(
                "bad header",
                file=path,
                place=key.name,
                value="nothing" if value is None else value,
                expected=f"a value of type {kind.__name__}, as the gateway wrote it",
            )
    return Header(**{key.name: document.get(key.name) for key in fields(Header)})


def map_text(name: str) -> str:
    """Text of a register map, given by its shipped name or its path."""
    shipped = Path(register_maps.__file__).with_name(f"{name}.toml")
    return (shipped if name in register_maps.names() else Path(name)).read_text("utf-8")


def map_of(header: Header) -> RegisterMap:
    """The register map that a recording was made with."""
    return parse(
        tomllib.loads(header.map_text),
        file=f"{header.map} in the recording",
        lines=Lines(header.map_text),
        source_hash=header.map_hash,
    )


def config_of(header: Header) -> Config:
    """The configuration that a recording was made with. Raises ConfigError for an unknown key."""
    document = {
        section: {RENAMED.get((section, key), key): value for key, value in entries.items()}
        for section, entries in header.config.items()
    }
    return from_document(document, place=lambda section, key: f"recording: [{section}] {key}")
