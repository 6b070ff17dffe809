"""Readiness of the bench: link and disk, then a run with a slow turn and a warm-up; a history."""

import csv
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import register_maps
from gateway.commissioning import readiness
from gateway.commissioning.check import Check, page
from gateway.configuration.config import Config
from gateway.cycle.record import Layout
from gateway.errors import ConfigError, GatewayError, PlcError
from gateway.recordings import step_runs
from gateway.workflows.check import compare_with_device
from gateway.workflows.live_program import run_program
from register_maps.register_map import RegisterMap

HISTORY: Final = "readiness.csv"
COLUMNS: Final = ("date", "name", "what", "value", "unit", "holds")
HOURS: Final = 8.0
"""[h] Recordings for which the disk must have room."""


@dataclass(frozen=True, kw_only=True)
class Readiness:
    """Values of all checks, the recording, and the tare of the time before (None: the first)."""

    checks: tuple[Check, ...]
    recording: Path
    before: str | None

    @property
    def holds(self) -> bool:
        """Whether every value lies within its limit."""
        return all(one.holds for one in self.checks)

    def to_json(self) -> dict[str, Any]:
        """Return the readiness as the document readiness/1."""
        return {
            "schema": "readiness/1",
            "holds": self.holds,
            "checks": [one.to_json() for one in self.checks],
            "recording": str(self.recording),
            "tare_before": self.before,
        }

    def __str__(self) -> str:
        before = [] if self.before is None else [f"tare before: {self.before}"]
        return "\n".join((page(self.checks), *before))


def ready(
    config: Config, *, warm_up: float, view: bool = True, report: Callable[[str], None]
) -> Readiness:
    """Check the bench before a day's runs, without a truck on the drum.

    warm_up : time at one speed [s]; view : show the run on standard output
    report : takes lines for the operator

    Raises GatewayError where the PLC does not answer or does not fit the register map, so that
    nothing turns, or where the run did not come to its end; ConfigError for a history that is none.
    """
    register_map = register_maps.load(config.plc.map)
    registers = _registers(config, register_map)
    if not registers.holds:
        raise GatewayError(f"nothing was turned; {registers.what}; see gateway registers verify")
    history = Path(config.recording.dir) / HISTORY
    before = _last_tare(history)
    standing = [registers, _disk(config, register_map)]
    program = readiness.readiness_program(warm_up)
    report(
        f"no truck on the drum; {program.duration:.0f} s from the moment in which the PLC is "
        "switched to remote"
    )
    ended = run_program(config.with_program(program), view=view)
    report(f"recording: {ended.recording}")
    if not ended.completed:
        raise GatewayError(f"the run did not come to its end: {ended.why}; see {ended.recording}")
    checks = (*standing, *readiness.evaluate(step_runs.read(ended.recording)))
    _remember(history, checks)
    return Readiness(checks=checks, recording=ended.recording, before=before)


def _registers(config: Config, register_map: RegisterMap) -> Check:
    """Registers of the live device that do not fit the map. Raises PlcError without a reply."""
    plc = config.plc
    try:
        found = compare_with_device(plc, register_map)
    except PlcError as error:
        raise PlcError(f"{error}; expected a PLC that answers") from error
    names = ", ".join(one.where for one in found) or "all fit"
    return Check(
        name="map",
        what=f"registers that do not fit: {names}",
        value=float(len(found)),
        unit="",
        limit=0.0,
        source=readiness.OWN,
    )


def _disk(config: Config, register_map: RegisterMap) -> Check:
    """Share of the free disk that a day's recordings take."""
    folder = Path(config.recording.dir)
    there = next(one for one in (folder.absolute(), *folder.absolute().parents) if one.exists())
    needed = Layout.of(register_map).size * HOURS * 3600.0 / config.loop.period
    return Check(
        name="disk",
        what=f"{HOURS:.0f} h of recordings, of the free room",
        value=100.0 * needed / max(shutil.disk_usage(there).free, 1),
        unit="%",
        limit=100.0,
        source=readiness.OWN,
    )


def _last_tare(history: Path) -> str | None:
    """Tare of the time before with its date; None: there is none. Raises ConfigError."""
    if not history.exists():
        return None
    try:
        rows = list(csv.DictReader(history.read_text("utf-8").splitlines()))
        tares = [row for row in rows if row["name"] == "tare"]
        return f"{tares[-1]['value']} Nm on {tares[-1]['date']}" if tares else None
    except (UnicodeDecodeError, KeyError) as error:
        expected = f"a table with {', '.join(COLUMNS)}, or no file"
        raise ConfigError("no history of ready", file=history, expected=expected) from error


def _remember(history: Path, checks: Sequence[Check]) -> None:
    """Append the values to the history."""
    date = datetime.now(UTC).isoformat(timespec="seconds")
    new = not history.exists()
    with history.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(COLUMNS)
        for one in checks:
            row = (date, one.name, one.what, f"{one.value:.4g}", one.unit, int(one.holds))
            writer.writerow(row)
