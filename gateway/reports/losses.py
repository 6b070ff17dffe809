"""The friction map of a bench for whoever wants it: gateway (TOML), machine, spreadsheet, eye.

Units here are the operator's: rpm, N m, N at the drum's rim, degC. matplotlib is imported only when
a picture is drawn.
"""

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.configuration.config import BenchConfig
from gateway.friction import Friction
from gateway.losses.fit import Fit
from gateway.losses.sections import LeftOut, Section
from register_maps.units import RPM, ZERO_CELSIUS

DIRECTION: Final = "forward only: the bench turns 0..4830 rpm"
WARMED: Final = 3.0
"""[K] of the shell during the run; sensors of the logs scatter by 1 K."""
UNITS: Final = ("N m", "N m (s/rad)^exponent", "1")


@dataclass(frozen=True, kw_only=True)
class Losses:
    """What was found, and in what.

    sources : of each run: name of the file, date, SHA-256
    """

    fit: Fit
    sections: Sequence[Section]
    left_out: Sequence[LeftOut]
    sources: Sequence[tuple[str, datetime, str]]
    bench: BenchConfig

    @property
    def shell(self) -> tuple[float, float] | None:
        """Coldest and warmest shell of the stretches [degC]; None: not known."""
        known = [one.shell_temperature for one in self.sections]
        if any(one is None for one in known):
            return None
        celsius = [one - ZERO_CELSIUS for one in known if one is not None]
        return min(celsius), max(celsius)

    @property
    def friction(self) -> Friction:
        """The law, at the shell temperature at which it was measured."""
        law, shell = self.fit.friction, self.shell
        if shell is None:
            return law
        middle = round(0.5 * (shell[0] + shell[1]), 1)
        return Friction(**law.document | {"reference_temperature_celsius": middle})

    @property
    def worst_percent(self) -> float:
        """Largest standard error of the friction between slowest and fastest speed [%]."""
        omega = np.linspace(self.fit.slowest, self.fit.fastest, 50)
        return float(100.0 * np.max(self.fit.torque_error(omega) / self.fit.torque(omega)))

    def rows(self) -> list[dict[str, Any]]:
        """The stretches, slowest first, units in the names."""
        rows = []
        for one, residual in zip(self.sections, self.fit.residuals, strict=True):
            rows.append(
                {
                    "run": one.run,
                    "start_s": round(one.start, 3),
                    "end_s": round(one.end, 3),
                    "motor_speed_rpm": round(one.motor_speed / RPM, 2),
                    "gear_speed_rad_s": round(one.gear_speed, 6),
                    "shaft_torque_Nm": round(one.shaft_torque, 4),
                    "friction_torque_Nm": round(one.friction, 3),
                    "standard_error_Nm": round(one.standard_error, 3),
                    "law_torque_Nm": round(one.friction - float(residual), 3),
                    "residual_Nm": round(float(residual), 3) + 0.0,  # no -0.0
                    "rim_force_N": round(one.friction / self.bench.drum_radius, 2),
                    "shell_temperature_degC": _celsius(one.shell_temperature),
                }
            )
        return sorted(rows, key=lambda row: row["gear_speed_rad_s"])


def _celsius(temperature: float | None) -> float | None:
    return None if temperature is None else round(temperature - ZERO_CELSIUS, 2)


def answer(losses: Losses) -> dict[str, Any]:
    """The answer for a machine (losses/1)."""
    law = losses.friction
    values = (law.coulomb, law.viscous, law.exponent)
    named = zip(("coulomb", "viscous", "exponent"), values, strict=True)
    errors = losses.fit.standard_errors
    return {
        "schema": "losses/1",
        "friction": {
            name: {"value": value, "standard_error": error, "unit": unit}
            for (name, value), error, unit in zip(named, errors, UNITS, strict=True)
        },
        "coulomb_held_at_zero": losses.fit.held_at_zero,
        "standard_error_percent": losses.worst_percent,
        "gear_speed_rad_s": [losses.fit.slowest, losses.fit.fastest],
        "direction": DIRECTION,
        "shell_temperature_degC": losses.shell,
        "sources": [
            {"file": name, "date": date.isoformat(timespec="seconds"), "sha256": digest}
            for name, date, digest in losses.sources
        ],
        "sections": losses.rows(),
        "left_out": [
            {
                "run": one.run,
                "start_s": one.start,
                "end_s": one.end,
                "motor_speed_rpm": one.motor_speed / RPM,
                "why": one.why,
            }
            for one in losses.left_out
        ],
    }


def toml(losses: Losses) -> str:
    """The friction map as a file that `[regulator] friction` takes."""
    law, shell = losses.friction, losses.shell
    coulomb, viscous, exponent = losses.fit.standard_errors
    names = [name for name, _, _ in losses.sources]
    date = max(date for _, date, _ in losses.sources)
    lines = [
        "# Friction of the bench: (coulomb + viscous |w|^exponent) sgn w at the gear output, N m,",
        "# w in rad/s; measured at steady speeds without a truck.",
        *(f"{name} = {value!r}" for name, value in law.document.items()),
        "",
        f"[measured]  # {DIRECTION}; standard errors are of scatter, the sensor's zero is in it",
        f"date = {date.isoformat(timespec='seconds')}",
        f"sources = {json.dumps(names)}",
        f"sha256 = {json.dumps([digest for _, _, digest in losses.sources])}",
        f"shell_temperature_degC = {list(map(_rounded, shell)) if shell else '[]  # not logged'}",
        f"gear_speed_rad_s = [{losses.fit.slowest:.4f}, {losses.fit.fastest:.4f}]",
        f"coulomb_standard_error_Nm = {coulomb:.4g}",
        f"viscous_standard_error = {viscous:.4g}",
        f"exponent_standard_error = {exponent:.4g}",
        f"torque_standard_error_percent = {losses.worst_percent:.3g}",
        f"program = {json.dumps('gateway ' + version('road-load-bench'))}",
    ]
    for row in losses.rows():
        known = (
            f"{name} = {json.dumps(value)}" for name, value in row.items() if value is not None
        )
        lines += ["", "[[measured.steady]]", *known]
    return "\n".join(lines) + "\n"


def _rounded(value: float) -> float:
    return round(value, 2)


def write_csv(path: Path, losses: Losses) -> None:
    """Write the stretches as a table, one a line."""
    rows = losses.rows()
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def summary(losses: Losses) -> str:
    """What is worth knowing, for the operator."""
    return "\n".join([*_table(losses), *_law(losses)])


def _table(losses: Losses) -> list[str]:
    measured = [
        f"{row['motor_speed_rpm']:10.1f} {row['shaft_torque_Nm']:10.3f} "
        f"{row['friction_torque_Nm']:12.2f} {row['standard_error_Nm']:5.2f} "
        f"{row['law_torque_Nm']:8.2f} {row['rim_force_N']:8.1f}"
        for row in losses.rows()
    ]
    left = [
        f"left out: {one.run} {one.start:.1f} .. {one.end:.1f} s, "
        f"{one.motor_speed / RPM:.0f} rpm: {one.why}"
        for one in losses.left_out
    ]
    return [" motor rpm   shaft Nm  friction Nm    +-   law Nm    rim N", *measured, *left]


def _law(losses: Losses) -> list[str]:
    law, shell, to_kmh = losses.friction, losses.shell, 3.6 * losses.bench.drum_radius
    coulomb, viscous, exponent = losses.fit.standard_errors
    slowest, fastest = to_kmh * losses.fit.slowest, to_kmh * losses.fit.fastest
    held = " (held at 0)" if losses.fit.held_at_zero else ""
    known = f"friction known to {losses.worst_percent:.2g} % (standard error) "
    warm = "shell temperature not known: the map holds while the gear is as warm as it was"
    if shell is not None:
        warm = f"shell {shell[0]:.1f} .. {shell[1]:.1f} degC: the map holds at that temperature"
        if shell[1] - shell[0] > WARMED:
            warm += "; it changed while the losses were measured, and they with it: warm up first"
    return [
        f"coulomb   {law.coulomb:9.3f} +- {coulomb:.3g} N m{held}",
        f"viscous   {law.viscous:9.3f} +- {viscous:.3g} N m (s/rad)^exponent",
        f"exponent  {law.exponent:9.4f} +- {exponent:.2g}",
        f"{known}from {slowest:.1f} to {fastest:.1f} km/h, {DIRECTION}",
        warm,
    ]


def draw(path: Path, losses: Losses) -> None:
    """Draw friction over speed, and the distances to the law."""
    from matplotlib.figure import Figure

    to_kmh = 3.6 * losses.bench.drum_radius
    omega = np.linspace(0.0, 1.05 * losses.fit.fastest, 200)[1:]
    torque, band = losses.fit.torque(omega), 2.0 * losses.fit.torque_error(omega)
    measured = np.array([[one.gear_speed, one.friction] for one in losses.sections])
    errors = 2.0 * np.array([one.standard_error for one in losses.sections])
    figure = Figure(figsize=(8.0, 6.5), layout="constrained", facecolor="white")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1.2])
    law = losses.friction
    above.set_title(
        f"{law.coulomb:.1f} + {law.viscous:.1f} w^{law.exponent:.3f} N m at the gear output",
        loc="left",
    )
    above.fill_between(to_kmh * omega, torque - band, torque + band, color="#0072B2", alpha=0.25)
    above.plot(to_kmh * omega, torque, color="#0072B2", linewidth=1.4, label="law, +- 2 s.e.")
    above.errorbar(
        to_kmh * measured[:, 0], measured[:, 1], errors, fmt="o", color="#D55E00", label="steady"
    )
    above.set_ylabel("friction [N m]")
    above.legend(frameon=False, loc="lower right")
    below.errorbar(to_kmh * measured[:, 0], losses.fit.residuals, errors, fmt="o", color="#D55E00")
    below.axhline(0.0, color="black", linewidth=0.6)
    below.set_ylabel("measured - law [N m]")
    below.set_xlabel("speed of the drum's rim [km/h]")
    for axes in (above, below):
        axes.grid(color="#e6e6e6", linewidth=0.6)
    figure.savefig(path, dpi=130, format=path.suffix.removeprefix(".") or "png")
