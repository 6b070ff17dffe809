"""The gateway's configuration: frozen records in SI, and the keys of its TOML with unit and range.

Each field declares its key once: name as in the file, factor to SI, range or choice, default. A
`Config` keeps its `document`, the whole of what was configured in the units of the file with all
defaults written out, so that a recording can carry it and `from_document` makes the same again.
Files are read in `config_file.py`; this module does not touch any.
"""

import hashlib
import json
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, get_type_hints

from gateway.errors import ConfigError
from gateway.friction import THESIS, Friction, from_friction
from gateway.keys import checked, declared, keys
from gateway.losses_speeds import Sweep, from_sweep

RPM = 2.0 * math.pi / 60.0
MILLI = 1e-3
PERCENT = 1e-2

Document = dict[str, dict[str, Any]]
Place = Callable[[str, str], str]


@dataclass(frozen=True, kw_only=True)
class PlcConfig:
    """Where the PLC is, and how long it may take [s]."""

    host: str = declared("host", "127.0.0.1")
    port: int = declared("port", 5020, lower=1, upper=65535)
    unit: int = declared("unit", 1, lower=0, upper=255)
    map: str = declared("map", "bench_int16")
    timeout: float = declared("timeout_ms", 40.0, scale=MILLI, lower=1.0, upper=1000.0)


@dataclass(frozen=True, kw_only=True)
class LoopConfig:
    """The clock. `stale`: age at which a sample is of no more use; `overruns`: deadlines in a row
    that may be missed."""

    period: float = declared("period_ms", 10.0, scale=MILLI, lower=1.0, upper=200.0)
    stale: float = declared("stale_ms", 100.0, scale=MILLI, lower=5.0, upper=1000.0)
    overruns: int = declared("overruns", 15, lower=1, upper=1000)
    realtime: bool = declared("realtime", True)


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """The bench as the regulator knows it (thesis, Table 3.1), and the filters in its PLC.

    torque_filter, speed_filter : time constants of first-order filters before the PLC's values [s]
    """

    drum_inertia: float = declared("drum_inertia_kg_m2", 312.69, lower=1.0, upper=1e5)
    gear_inertia: float = declared("gear_inertia_kg_m2", 0.02242, lower=0.0, upper=1e4)
    drum_radius: float = declared("drum_radius_m", 0.645, lower=0.05, upper=5.0)
    gear_ratio: float = declared("gear_ratio", 62.6, lower=1.0, upper=1000.0)
    dead_time: float = declared("dead_time_ms", 63.947, scale=MILLI, lower=0.0, upper=500.0)
    torque_filter: float = declared("torque_filter_ms", 0.0, scale=MILLI, lower=0.0, upper=1000.0)
    speed_filter: float = declared("speed_filter_ms", 0.0, scale=MILLI, lower=0.0, upper=1000.0)
    flux_constant: float = declared("flux_constant", 1.8506, lower=0.01, upper=100.0)
    flux_constant_1: float = declared("flux_constant_1", 366.83, lower=1.0, upper=1e5)
    flux_constant_2: float = declared("flux_constant_2", 8.0644, lower=0.0, upper=1e3)


@dataclass(frozen=True, kw_only=True)
class TruckConfig:
    """The truck that the bench imitates.

    crr, crr_v : rolling resistance [1], and its part with the drum's speed [s] (thesis, eq 4.11)
    f0, f1, f2 : road load instead of crr, crr_v [N], [N s/m], [N s^2/m^2]; None: crr holds
    grade : rise over run [1]; top_speed, acceleration, braking : what the run will ask for
    """

    mass: float = declared("mass_kg", 3640.0, lower=50.0, upper=1e5)
    load: float = declared("load_kg", 0.0, lower=0.0, upper=1e5)
    wheel_radius: float = declared("wheel_radius_m", 0.1715, lower=0.02, upper=2.0)
    crr: float = declared("crr", 0.011721, lower=0.0, upper=0.2)
    crr_v: float = declared("crr_v", 9.3882e-6, lower=0.0, upper=0.1)
    f0: float | None = declared("f0_N", None, lower=0.0, upper=1e5)
    f1: float | None = declared("f1_N_per_m_s", None, lower=-1e4, upper=1e4)
    f2: float | None = declared("f2_N_per_m2_s2", None, lower=-1e3, upper=1e3)
    grade: float = declared("grade_percent", 0.0, scale=PERCENT, lower=-50.0, upper=50.0)
    top_speed: float = declared("top_speed_km_h", 14.0, scale=1.0 / 3.6, lower=0.1, upper=100.0)
    acceleration: float = declared("acceleration_m_s2", 0.65, lower=0.0, upper=10.0)
    braking: float = declared("braking_m_s2", 1.05, lower=0.0, upper=10.0)

    @property
    def total_mass(self) -> float:
        """Mass with its load [kg]."""
        return self.mass + self.load


@dataclass(frozen=True, kw_only=True)
class RegulatorConfig:
    """Which regulator, and what it knows.

    lead : [s] of the emulated acceleration added; trim : gain on virtual minus drum speed [1];
        at 0.8 the shaft torque rings after a reversal, with 64 ms dead time and 10 ms scan
    under_compensation : share of the friction left out; _slow : the same at standstill, from where
        it falls to the other at 0.5 rad/s of the drum
    torque_offset : what the sensor shows at no torque [N m]
    breakaway : torque over the road load at which a standing truck starts to roll [N m at the drum]
    """

    name: str = declared("name", "compensated")
    torque: str = declared(
        "torque", "integrated", choices=("integrated", "averaged", "instantaneous")
    )
    lead: float = declared("lead_s", 0.085, lower=0.0, upper=1.0)
    trim: float = declared("trim", 0.5, lower=0.0, upper=5.0)
    under_compensation: float = declared(
        "under_compensation_percent", 0.3, scale=PERCENT, lower=0.0, upper=20.0
    )
    under_compensation_slow: float = declared(
        "under_compensation_slow_percent", 2.0, scale=PERCENT, lower=0.0, upper=20.0
    )
    torque_offset: float = declared("torque_offset_Nm", 0.0, lower=-20.0, upper=20.0)
    breakaway: float = declared("breakaway_Nm", 30.0, lower=0.0, upper=2000.0)
    friction: Friction = THESIS


@dataclass(frozen=True, kw_only=True)
class LimitsConfig:
    """What no setpoint may exceed. Speeds are the motor's.

    rate_up, rate_down : slopes; deviation : setpoint from measured speed
    overspeed : measured speed at which the run ends; current : that the PLC may use
    watchdog : after which the PLC ramps down by itself
    """

    speed_max: float = declared("speed_max_rpm", 4830.0, scale=RPM, lower=1.0, upper=4830.0)
    rate_up: float = declared("rate_up_rpm_s", 3000.0, scale=RPM, lower=1.0, upper=30000.0)
    rate_down: float = declared("rate_down_rpm_s", 3000.0, scale=RPM, lower=1.0, upper=30000.0)
    deviation: float = declared("deviation_rpm", 400.0, scale=RPM, lower=1.0, upper=4830.0)
    overspeed: float = declared("overspeed_rpm", 5070.0, scale=RPM, lower=1.0, upper=6000.0)
    current: float = declared("current_limit_A", 72.0, lower=0.0, upper=72.0)
    watchdog: float = declared("watchdog_ms", 200.0, scale=MILLI, lower=50.0, upper=1000.0)


@dataclass(frozen=True, kw_only=True)
class RecordingConfig:
    """Where recordings go."""

    dir: str = declared("dir", "recordings")


SECTIONS: dict[str, type] = {
    "plc": PlcConfig,
    "loop": LoopConfig,
    "bench": BenchConfig,
    "truck": TruckConfig,
    "regulator": RegulatorConfig,
    "limits": LimitsConfig,
    "recording": RecordingConfig,
}
SWEEP = "sweep"


def _defaults() -> Document:
    written: Document = {
        name: {key.name: key.default for key in keys(section).values() if key.default is not None}
        for name, section in SECTIONS.items()
    }
    written["regulator"]["friction"] = THESIS.document
    return written


@dataclass(frozen=True, kw_only=True)
class Config:
    """Everything that is configured. Changed with `with_values`, so that `document` stays true.

    sweep : steady speeds that are held instead of a road load; None: none
    document : sections, keys and values as in a file, defaults written out; JSON can hold it
    """

    plc: PlcConfig = field(default_factory=PlcConfig)
    loop: LoopConfig = field(default_factory=LoopConfig)
    bench: BenchConfig = field(default_factory=BenchConfig)
    truck: TruckConfig = field(default_factory=TruckConfig)
    regulator: RegulatorConfig = field(default_factory=RegulatorConfig)
    limits: LimitsConfig = field(default_factory=LimitsConfig)
    recording: RecordingConfig = field(default_factory=RecordingConfig)
    sweep: Sweep | None = None
    document: Document = field(default_factory=_defaults)

    def with_values(self, values: Mapping[str, str]) -> "Config":
        """The same with `{"section.key": "value as in TOML"}` instead."""
        return from_document(changed(self.document, values), place=_set_place)


def changed(document: Document, values: Mapping[str, str]) -> Document:
    """A document with `{"section.key": "value as in TOML"}` put in."""
    result = {section: dict(entries) for section, entries in document.items()}
    for name, text in values.items():
        section, _, key = name.partition(".")
        result.setdefault(section, {})[key] = _parsed(text)
    return result


def _parsed(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text  # a bare word, as one types it on a command line


def _set_place(section: str, key: str) -> str:
    return f"{section}.{key}"


def from_document(document: Mapping[str, Any], *, place: Place = _set_place) -> Config:
    """The configuration in a document; `place` names where a key stands, for the error."""
    written = _defaults()
    sections: dict[str, Any] = {}
    for name, entries in document.items():
        if name == SWEEP:
            sections[name] = from_sweep(entries, place(name, "").rstrip(" ."))
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
        if section is RegulatorConfig and entry == "friction":
            values["friction"] = from_friction(value, where)
            continue
        if entry not in known:
            expected = ", ".join(sorted(known))
            raise ConfigError("unknown key", place=where, value=entry, expected=expected)
        field_name, key = known[entry]
        values[field_name] = checked(key, hints[field_name], value, where)
    return section(**values)


def _form_of_road_load(document: Mapping[str, Any], place: Place) -> None:
    """Road load is told once: either by crr or by f0 .. f2."""
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
    """SHA-256 over the document: the same for the same configuration however it was written."""
    text = json.dumps(config.document, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
