"""The friction map of a bench: the law, and the steady stretches that it was fitted to (pure).

Units here are the operator's: rpm, N m, N at the drum's rim, degC.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from typing import Any, Final

import numpy as np

from gateway.configuration.config import BenchConfig
from gateway.friction.law import Friction
from gateway.losses.fit import FrictionFit
from gateway.losses.sections import LeftOut, Section
from register_maps.units import RPM, ZERO_CELSIUS

DIRECTION: Final = "forward only: the bench turns 0..4830 rpm"
UNITS: Final = {"coulomb": "N m", "viscous": "N m (s/rad)^exponent", "exponent": "1"}


@dataclass(frozen=True, kw_only=True)
class Source:
    """File of a run: its name, its date, its SHA-256."""

    file: str
    date: datetime
    sha256: str

    def to_json(self) -> dict[str, str]:
        """Return the source as an entry of the document losses/1."""
        date = self.date.isoformat(timespec="seconds")
        return {"file": self.file, "date": date, "sha256": self.sha256}


@dataclass(frozen=True, kw_only=True)
class Row:
    """One steady stretch in the operator's units. A field is a column of the table.

    law_torque_Nm : friction of the law; residual_Nm : measured friction minus that
    """

    run: str
    start_s: float
    end_s: float
    motor_speed_rpm: float
    gear_speed_rad_s: float
    shaft_torque_Nm: float
    friction_torque_Nm: float
    standard_error_Nm: float
    law_torque_Nm: float
    residual_Nm: float
    rim_force_N: float
    shell_temperature_degC: float | None


@dataclass(frozen=True, kw_only=True)
class Losses:
    """The friction of a bench, and the runs that show it.

    sections, left_out : steady stretches that are used, and those that are not
    bench : of the last run
    """

    fit: FrictionFit
    sections: Sequence[Section]
    left_out: Sequence[LeftOut]
    sources: Sequence[Source]
    bench: BenchConfig

    @property
    def shell(self) -> tuple[float, float] | None:
        """Lowest and highest shell temperature of the stretches [degC]; None: unknown."""
        known = [one.shell_temperature for one in self.sections]
        if any(one is None for one in known):
            return None
        celsius = [one - ZERO_CELSIUS for one in known if one is not None]
        return min(celsius), max(celsius)

    @property
    def friction(self) -> Friction:
        """Friction law with the shell temperature of the measurement as its reference."""
        law, shell = self.fit.friction, self.shell
        if shell is None:
            return law
        middle = round(0.5 * (shell[0] + shell[1]), 1)
        return replace(law, reference_temperature_celsius=middle)

    @property
    def worst_percent(self) -> float:
        """Largest relative standard error of the friction between slowest and fastest speed [%]."""
        omega = np.linspace(self.fit.slowest, self.fit.fastest, 50)
        return float(100.0 * np.max(self.fit.torque_error(omega) / self.fit.torque(omega)))

    def rows(self) -> list[Row]:
        """Steady stretches in the operator's units, slowest first."""
        pairs = zip(self.sections, self.fit.residuals, strict=True)
        rows = [_row(one, float(residual), self.bench) for one, residual in pairs]
        return sorted(rows, key=lambda row: row.gear_speed_rad_s)

    def to_json(self) -> dict[str, Any]:
        """Return the friction map as the document losses/1."""
        law, errors = self.friction, self.fit.standard_errors
        values = (law.coulomb, law.viscous, law.exponent)
        return {
            "schema": "losses/1",
            "friction": {
                name: {"value": value, "standard_error": error, "unit": unit}
                for (name, unit), value, error in zip(UNITS.items(), values, errors, strict=True)
            },
            "coulomb_held_at_zero": self.fit.held_at_zero,
            "standard_error_percent": self.worst_percent,
            "gear_speed_rad_s": [self.fit.slowest, self.fit.fastest],
            "direction": DIRECTION,
            "shell_temperature_degC": self.shell,
            "sources": [one.to_json() for one in self.sources],
            "sections": [asdict(row) for row in self.rows()],
            "left_out": [_left_out(one) for one in self.left_out],
        }


def _row(section: Section, residual: float, bench: BenchConfig) -> Row:
    shell = section.shell_temperature
    return Row(
        run=section.run,
        start_s=round(section.start, 3),
        end_s=round(section.end, 3),
        motor_speed_rpm=round(section.motor_speed / RPM, 2),
        gear_speed_rad_s=round(section.gear_speed, 6),
        shaft_torque_Nm=round(section.shaft_torque, 4),
        friction_torque_Nm=round(section.friction, 3),
        standard_error_Nm=round(section.standard_error, 3),
        law_torque_Nm=round(section.friction - residual, 3),
        residual_Nm=round(residual, 3) + 0.0,  # no -0.0
        rim_force_N=round(section.friction / bench.drum_radius, 2),
        shell_temperature_degC=None if shell is None else round(shell - ZERO_CELSIUS, 2),
    )


def _left_out(one: LeftOut) -> dict[str, Any]:
    return {
        "run": one.run,
        "start_s": one.start,
        "end_s": one.end,
        "motor_speed_rpm": one.motor_speed / RPM,
        "why": one.why,
    }
