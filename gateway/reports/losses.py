"""The report of a loss measurement: TOML for the gateway, table, lines, picture.

Units here are the operator's: rpm, N m, N at the drum's rim, degC. matplotlib is imported only when
a picture is drawn.
"""

import csv
import json
from dataclasses import asdict, fields
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np

from gateway.losses.result import DIRECTION, Losses, Row
from register_maps.units import KMH, RPM

WARMED: Final = 3.0
"""[K] Change of the shell that counts as warming; the sensors of the logs scatter by 1 K."""


def toml(losses: Losses) -> str:
    """Friction map as a TOML file that `[regulator] friction` takes."""
    law, shell = losses.friction, losses.shell
    coulomb, viscous, exponent = losses.fit.standard_errors
    names = [one.file for one in losses.sources]
    date = max(one.date for one in losses.sources)
    lines = [
        "# Friction of the bench: (coulomb + viscous |w|^exponent) sgn w at the gear output, N m,",
        "# w in rad/s; measured at steady speeds without a truck.",
        *(f"{name} = {value!r}" for name, value in law.document.items()),
        "",
        f"[measured]  # {DIRECTION}; standard errors are of scatter, the sensor's zero is in it",
        f"date = {date.isoformat(timespec='seconds')}",
        f"sources = {json.dumps(names)}",
        f"sha256 = {json.dumps([one.sha256 for one in losses.sources])}",
        f"shell_temperature_degC = {list(map(_round, shell)) if shell else '[]  # not logged'}",
        f"gear_speed_rad_s = [{losses.fit.slowest:.4f}, {losses.fit.fastest:.4f}]",
        f"coulomb_standard_error_Nm = {coulomb:.4g}",
        f"viscous_standard_error = {viscous:.4g}",
        f"exponent_standard_error = {exponent:.4g}",
        f"torque_standard_error_percent = {losses.worst_percent:.3g}",
        f"program = {json.dumps('gateway ' + version('road-load-bench'))}",
    ]
    for row in losses.rows():
        known = (
            f"{name} = {json.dumps(value)}"
            for name, value in asdict(row).items()
            if value is not None
        )
        lines += ["", "[[measured.steady]]", *known]
    return "\n".join(lines) + "\n"


def _round(value: float) -> float:
    return round(value, 2)


def write_csv(path: Path, losses: Losses) -> None:
    """Write the steady stretches as CSV, one a line."""
    with path.open("w", encoding="utf-8", newline="") as file:
        columns = [field.name for field in fields(Row)]
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(row) for row in losses.rows())


def summary(losses: Losses) -> str:
    """Lines for the operator: steady stretches, friction law, standard errors."""
    return "\n".join([*_table(losses), *_law(losses)])


def _table(losses: Losses) -> list[str]:
    measured = [
        f"{row.motor_speed_rpm:10.1f} {row.shaft_torque_Nm:10.3f} "
        f"{row.friction_torque_Nm:12.2f} {row.standard_error_Nm:5.2f} "
        f"{row.law_torque_Nm:8.2f} {row.rim_force_N:8.1f}"
        for row in losses.rows()
    ]
    left = [
        f"left out: {one.run} {one.start:.1f} .. {one.end:.1f} s, "
        f"{one.motor_speed / RPM:.0f} rpm: {one.why}"
        for one in losses.left_out
    ]
    return [" motor rpm   shaft Nm  friction Nm    +-   law Nm    rim N", *measured, *left]


def _law(losses: Losses) -> list[str]:
    law, shell, to_kmh = losses.friction, losses.shell, losses.bench.drum_radius / KMH
    coulomb, viscous, exponent = losses.fit.standard_errors
    slowest, fastest = to_kmh * losses.fit.slowest, to_kmh * losses.fit.fastest
    held = " (held at 0)" if losses.fit.held_at_zero else ""
    known = f"friction known to {losses.worst_percent:.2g} % (standard error) "
    warm = "shell temperature unknown: the map holds while the gear is as warm as in the run"
    if shell is not None:
        warm = f"shell {shell[0]:.1f} .. {shell[1]:.1f} degC: the map holds at that temperature"
        if shell[1] - shell[0] > WARMED:
            warm += "; it changed during the measurement, and the losses with it: warm up first"
    return [
        f"coulomb   {law.coulomb:9.3f} +- {coulomb:.3g} N m{held}",
        f"viscous   {law.viscous:9.3f} +- {viscous:.3g} N m (s/rad)^exponent",
        f"exponent  {law.exponent:9.4f} +- {exponent:.2g}",
        f"{known}from {slowest:.1f} to {fastest:.1f} km/h, {DIRECTION}",
        warm,
    ]


def draw(path: Path, losses: Losses) -> None:
    """Draw friction over speed, and the residuals."""
    from matplotlib.figure import Figure

    to_kmh = losses.bench.drum_radius / KMH
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
