"""The configuration of the gateway, and the document that it comes from.

A `Config` keeps its `document`: all values in the units of the file, with every default. A
recording carries the document, and `from_document` makes an equal configuration from it.
`sections.py` has the sections, and `gateway/config_file.py` reads files.
"""

import hashlib
import json
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, get_type_hints

from gateway.configuration.keys import keys, read_value
from gateway.configuration.memory import read_memory
from gateway.configuration.program import Program, document_of, read_program
from gateway.configuration.sections import (
    SECTIONS,
    BenchConfig,
    LimitsConfig,
    LoopConfig,
    MetricsConfig,
    PlausibilityConfig,
    PlcConfig,
    RecordingConfig,
    RegulatorConfig,
    TruckConfig,
    VerificationConfig,
)
from gateway.configuration.sweep_speeds import read_sweep
from gateway.errors import ConfigError
from gateway.friction.document import read_friction
from gateway.friction.law import THESIS

__all__ = ["BenchConfig", "Config", "config_hash", "from_document", "merge"]

Document = dict[str, dict[str, Any]]
Place = Callable[[str, str], str]
PROGRAMS = {"sweep": read_sweep, "program": read_program}
"""Tables that ask for a program, and what reads them."""
TABLES: dict[str, Callable[[object, str], Any]] = {
    "friction": read_friction,
    "learned": read_memory,
}
"""Tables inside [regulator], and what reads them."""


def _defaults() -> Document:
    written: Document = {
        name: {key.name: key.default for key in keys(section).values() if key.default is not None}
        for name, section in SECTIONS.items()
    }
    written["regulator"]["friction"] = THESIS.document
    return written


@dataclass(frozen=True, kw_only=True)
class Config:
    """Configuration of the gateway in SI. Change it by `with_values`, which keeps `document` true.

    program : steps to go through instead of a road load; None: road load
    document : sections, keys and values as in a file, with every default; can be written as JSON
    """

    plc: PlcConfig = field(default_factory=PlcConfig)
    loop: LoopConfig = field(default_factory=LoopConfig)
    bench: BenchConfig = field(default_factory=BenchConfig)
    truck: TruckConfig = field(default_factory=TruckConfig)
    regulator: RegulatorConfig = field(default_factory=RegulatorConfig)
    limits: LimitsConfig = field(default_factory=LimitsConfig)
    plausibility: PlausibilityConfig = field(default_factory=PlausibilityConfig)
    recording: RecordingConfig = field(default_factory=RecordingConfig)
    metrics: MetricsConfig = field(default_factory=MetricsConfig)
    verification: VerificationConfig = field(default_factory=VerificationConfig)
    program: Program | None = None
    document: Document = field(default_factory=_defaults)

    def with_values(self, values: Mapping[str, object]) -> "Config":
        """Configuration with some values changed, `{"truck.load_kg": 1600}`; see `merge`."""
        return from_document(merge(self.document, values), place=_set_place)

    def with_program(self, program: Program) -> "Config":
        """Configuration that goes through a program instead of a road load."""
        return from_document({**self.document, "program": document_of(program)})


def merge(document: Document, values: Mapping[str, object]) -> Document:
    """Put values into a copy of a document, `{"truck.load_kg": 1600}`; a text is read as TOML."""
    result = {section: dict(entries) for section, entries in document.items()}
    for name, value in values.items():
        section, _, key = name.partition(".")
        result.setdefault(section, {})[key] = _parse(value) if isinstance(value, str) else value
    return result


def _parse(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text  # a bare word, typed without quotes on a command line


def _set_place(section: str, key: str) -> str:
    return f"{section}.{key}"


def from_document(document: Mapping[str, Any], *, place: Place = _set_place) -> Config:
    """Configuration in a document. Raises ConfigError; `place` names section and key there."""
    written = _defaults()
    sections: dict[str, Any] = {}
    for name, entries in document.items():
        if name in PROGRAMS:
            sections["program"] = PROGRAMS[name](entries, place(name, "").rstrip(" ."))
            written[name] = dict(entries)
            continue
        if name not in SECTIONS or not isinstance(entries, Mapping):
            raise ConfigError(
                "unknown section", place=place(name, ""), value=name, expected=", ".join(SECTIONS)
            )
        written[name] |= entries
    for name, section in SECTIONS.items():
        sections[name] = _section(name, section, written[name], place)
    _form_of_road_load(document, place)
    return Config(**sections, document=written)


def _section(name: str, section: type, entries: Mapping[str, Any], place: Place) -> Any:
    known = {key.name: (field_name, key) for field_name, key in keys(section).items()}
    hints = get_type_hints(section)
    values = {}
    for entry, value in entries.items():
        where = place(name, entry)
        if section is RegulatorConfig and entry in TABLES:
            values[entry] = TABLES[entry](value, where)
            continue
        if entry not in known:
            expected = ", ".join(sorted(known))
            raise ConfigError("unknown key", place=where, value=entry, expected=expected)
        field_name, key = known[entry]
        values[field_name] = read_value(key, hints[field_name], value, where)
    return section(**values)


def _form_of_road_load(document: Mapping[str, Any], place: Place) -> None:
    """Refuse f1 or f2 without f0: the road load is given either by crr or by f0 .. f2."""
    truck = document.get("truck", {})
    given = [key for key in ("f0_N", "f1_N_per_m_s", "f2_N_per_m2_s2") if key in truck]
    if given and "f0_N" not in truck:
        raise ConfigError(
            "road load without its constant part",
            place=place("truck", given[0]),
            value=truck[given[0]],
            expected="f0_N beside it",
        )


def config_hash(config: Config) -> str:
    """SHA-256 over the document; equal configurations have equal hashes."""
    text = json.dumps(config.document, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
