"""Writes an identified truck as the `[truck]` table of the gateway's configuration (pure)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.road_load.answer import RoadAnswer
    from plant_emulator.road_load.truck_model import Truck


def table(answer: RoadAnswer, truck: Truck, origin: Sequence[str]) -> str:
    """Text of a TOML file with the `[truck]` table.

    origin : lines about the origin of the values, written as comments
    The table holds the road load as F0 and F1, which do not depend on a drum. Comments hold the
    estimates that the gateway does not need.
    """
    lines = [*origin, "Standard errors at the end of a line; mass and radius as given.", ""]
    names = ("crr", "crr_v", "efficiency", "torque_gain", "torque_offset_Nm")
    lines += [f"{name} = {answer.estimates[name]}" for name in names]
    lines += [f"Not separable: {text}" for text in answer.not_separable]
    f0, f1 = answer.estimates["f0_newton"], answer.estimates["f1_newton_per_m_s"]
    keys = [
        "[truck]",
        f"mass_kg = {truck.mass!r}  # with its load",
        "load_kg = 0.0",
        f"wheel_radius_m = {truck.wheel_radius!r}",
        f"f0_N = {f0.value:.6g}  # +- {f0.standard_error:.2g}",
        f"f1_N_per_m_s = {f1.value:.6g}  # +- {f1.standard_error:.2g}",
    ]
    return "\n".join([f"# {line}".rstrip() for line in lines] + keys) + "\n"
