"""Configuration, register map, loop stability and aliasing, before any start."""

import json
from pathlib import Path
from typing import Any

import click

import register_maps
from gateway.cli._options import assignments
from gateway.config_file import load, with_values
from gateway.configuration.config import Config
from gateway.link import device, inspection
from gateway.link.plc import LinkError
from gateway.review import review
from gateway.review.finding import Finding, holds
from register_maps.command_line.parameters import Command, OutputFile
from register_maps.register_map import RegisterMap

COLOURS = {"error": "red", "warning": "yellow", "info": "green"}


EXAMPLE = """
\b
Examples:
  gateway check -c bench.toml
  gateway check -c bench.toml --set truck.mass_kg=500 --set regulator.lead_s=0
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option("-c", "--config", type=click.Path(path_type=Path), required=True, help="TOML file")
@click.option("--live", is_flag=True, help="also compare the register map with the device")
@click.option("--set", "values", multiple=True, metavar="KEY=VALUE", help="instead of the file's")
@click.option(
    "--json", "target", type=OutputFile(dash=True), help="machine-readable answer, - = stdout"
)
def command(config: Path, *, live: bool, values: tuple[str, ...], target: str | None) -> int:
    """Say what the configuration lets expect of the bench.

    Exit code 0: it holds; 1: it does not; 2: bad input.
    """
    settings = with_values(load(config), assignments(values))
    register_map = register_maps.load(settings.plc.map)
    found = review.review(settings, register_map)
    if live:
        found = [*compared(settings, register_map), *found]
    answer = {
        "schema": "check/1",
        "holds": holds(found),
        "findings": [as_json(finding) for finding in found],
    }
    if target != "-":
        show(found, holds=holds(found))
    if target is not None:
        with click.open_file(target, "w", encoding="utf-8") as file:
            file.write(json.dumps(answer, indent=2) + "\n")
    return 0 if holds(found) else 1


def as_json(finding: Finding) -> dict[str, Any]:
    """A finding as it stands in check/1."""
    return {
        "severity": finding.severity,
        "where": finding.where,
        "what": finding.what,
        "value": finding.value,
        "allowed": finding.allowed,
    }


def show(found: list[Finding], *, holds: bool) -> None:
    """The findings for the operator, one a line."""
    for finding in found:
        severity = click.style(f"{finding.severity:8}", fg=COLOURS[finding.severity])
        line = f"{finding.where}: {finding.what}: {finding.value}, allowed {finding.allowed}"
        click.echo(f"{severity}{line}")
    click.echo("holds" if holds else "does not hold")


def compared(config: Config, register_map: RegisterMap) -> list[Finding]:
    """What speaks against the register map at the device itself."""
    plc = config.plc
    peer = device.Device(host=plc.host, port=plc.port, unit=plc.unit, timeout=plc.timeout)
    try:
        rows = inspection.verify(register_map, device.two_readings(peer, register_map))
    except LinkError as error:
        return [_found("plc.host", str(error), f"{plc.host}:{plc.port}", "a PLC that answers")]
    wrong = [row for row in rows if not row.holds]
    findings = [
        _found(row.register.name, row.finding, _value(row), row.register.description)
        for row in wrong
    ]
    return findings + [
        _found("plc.map", "map version of the command block", row.value, str(register_map.version))
        for row in rows
        if row.register.signal == "map_version"
        and row.value not in {None, 0.0, float(register_map.version)}
    ]


def _value(row: inspection.Row) -> float | str:
    return " ".join(f"0x{word:04x}" for word in row.words) if row.value is None else row.value


def _found(where: str, what: str, value: float | str | None, allowed: str) -> Finding:
    return Finding(
        severity="error",
        where=where,
        what=what,
        value="nothing" if value is None else value,
        allowed=allowed,
    )
