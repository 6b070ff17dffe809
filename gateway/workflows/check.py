"""The check before a start: review of the configuration, and of the live device where asked."""

from collections.abc import Mapping
from pathlib import Path

import register_maps
from gateway import config_file
from gateway.configuration.config import Config
from gateway.configuration.sections import PlcConfig
from gateway.link import device, inspection, tls
from gateway.link.plc import LinkError
from gateway.review.finding import Finding, Review
from gateway.review.review import review
from register_maps.register_map import RegisterMap


def check(
    config: Config | str | Path, *, values: Mapping[str, object] | None = None, live: bool = False
) -> Review:
    """Review a configuration before anything turns.

    config : configuration, or path of its TOML file
    values : keys to change, `{"truck.load_kg": 1600}`; a text is read as TOML
    live : also compare the register map with the device

    Raises ConfigError for a configuration and MapError for a register map that cannot be used.
    """
    settings = config_file.with_values(config_file.as_config(config), values or {})
    register_map = register_maps.load(settings.plc.map)
    found = review(settings, register_map)
    if not live:
        return found
    try:
        compared = compare_with_device(settings.plc, register_map)
        compared.append(compare_pace(settings, register_map))
    except LinkError as error:
        place = f"{settings.plc.host}:{settings.plc.port}"
        compared = [_error("plc.host", str(error), place, "a PLC that answers")]
    return Review(findings=(*compared, *found.findings))


def compare_pace(config: Config, register_map: RegisterMap) -> Finding:
    """Finding on the round trips of the live device: a tick takes two of them."""
    try:
        times = device.round_trips(_peer(config.plc), register_map.measurement)
    except LinkError as error:
        return _error("loop.period_ms", f"round trips: {error}", "no reply", "100 replies")
    half, late, longest = times[len(times) // 2], times[len(times) * 99 // 100], times[-1]
    period = config.loop.period
    severity = "info" if 2.0 * late <= period else "warning"
    return Finding(
        severity="error" if 2.0 * half > period else severity,
        where="loop.period_ms",
        what=f"round trip in ms: p50 {half * 1e3:.1f}, p99 {late * 1e3:.1f}, max "
        f"{longest * 1e3:.1f}; a tick takes two of them",
        value=round(2e3 * half, 1),
        allowed=f"<= {period * 1e3:g}",
    )


def _peer(plc: PlcConfig) -> device.Device:
    """Device of the PLC; its first reply may take the settle time."""
    timeout = max(plc.timeout, plc.settle)
    return device.Device(
        host=plc.host, port=plc.port, unit=plc.unit, timeout=timeout, tls=tls.context(plc)
    )


def compare_with_device(plc: PlcConfig, register_map: RegisterMap) -> list[Finding]:
    """Errors that the registers of the live device show in the register map.

    Raises LinkError where it does not answer.
    """
    readings = device.two_readings(_peer(plc), register_map)
    rows = inspection.verify(register_map, readings).rows
    findings = [
        _error(row.register.name, row.finding, _value(row), row.register.description)
        for row in rows
        if not row.holds
    ]
    return findings + [
        _error("plc.map", "map version of the command block", row.value, str(register_map.version))
        for row in rows
        if row.register.signal == "map_version"
        and row.value not in {None, 0.0, float(register_map.version)}
    ]


def _value(row: inspection.RegisterRow) -> float | str:
    return " ".join(f"0x{word:04x}" for word in row.words) if row.value is None else row.value


def _error(where: str, what: str, value: float | str | None, allowed: str) -> Finding:
    shown = "nothing" if value is None else value
    return Finding(severity="error", where=where, what=what, value=shown, allowed=allowed)
