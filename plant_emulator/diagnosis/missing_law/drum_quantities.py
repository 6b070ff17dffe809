"""Quantities on the drum's side of the gear: friction and torque on the drum, its speed sensor."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.drum_subsystem import LAWS_OF_ANGLE, is_torque_size
from plant_emulator.diagnosis.localisation.measured_signals import NOISES
from plant_emulator.diagnosis.localisation.parity_relations import GEAR
from plant_emulator.diagnosis.missing_law.quantity import (
    BenchQuantity,
    angle_of,
    in_relations,
    time_of,
)
from plant_emulator.diagnosis.missing_law.states import FILTER_TIMES, LawState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.localisation.block_basis import BlockQuantities
    from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array

# Torque on the drum whose response is linearised [N m], in the size of a bearing's friction.
SMALL_TORQUE = 5.0
# Largest multiple of its angle that a torque on the drum is looked for at. Its inertia hides faster
# ones from its speed, and the gear's relation takes them for friction of the gear.
LARGEST_WEIGHT_MULTIPLE = 4.5


def drum_friction(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    """Friction on the drum.

    The drum's flight through its gap is far from linear in such a torque. The response is therefore
    that of the fit with an unknown torque, to the splines of which a law is fitted.
    """
    xi, fitted = r.values["gear_ratio"], r.torque_fits[-1]
    speed = LawState(
        values=[np.abs(one.speed) / xi for one in q], time=[one.time for one in q],
        name="drum speed", symbol="w", unit="rad/s", code="abs(s.drum_speed)", kind="level",
    )  # fmt: skip

    def rows(run: int, values: Array) -> tuple[Array, Array]:
        torque = -values * q[run].moving[:, None]
        splines = r.drum.laws[run][1:, :-LAWS_OF_ANGLE]
        sizes, *_ = np.linalg.lstsq(splines, torque, rcond=1e-6)
        slopes = fitted.jacobians[run][0][:, is_torque_size(fitted)][:, :-LAWS_OF_ANGLE]
        return in_relations({GEAR: 1.0 / xi}, torque), -slopes @ sizes

    return BenchQuantity(
        place="drum",
        name="friction on the drum",
        unit="N m",
        hook="drum_coulomb_friction",
        states=(speed,),
        rows=rows,
        model=r.linear_model(fitted),
    )


def drum_weight(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    """Torque on the drum that does not follow the direction of the motion, as a weight's."""
    xi = r.values["gear_ratio"]
    angle = replace(_drum_angle(q), scanned=LARGEST_WEIGHT_MULTIPLE)

    def rows(run: int, values: Array) -> tuple[Array, Array]:
        return in_relations({GEAR: 1.0 / xi}, values), _drum_response(r, r.drum_fit, run, values)

    return BenchQuantity(
        place="drum",
        name="torque on the drum",
        unit="N m",
        hook="drum_torque",
        states=(angle,),
        rows=rows,
        model=r.model,
    )


def _drum_response(r: BlockRegression, fitted: Estimate, run: int, torque: Array) -> Array:
    """Response of the drum speed over its noise to torques on the drum, shape (n, k).

    fitted : where the drum subsystem is linearised
    """
    found = {**fitted.parameters(), **fitted.states(run)}
    known = r.drum.laws[run]
    size_name = f"torque_{known.shape[1]}"
    before = r.drum.residual(run, found)
    columns = []
    for own in np.concatenate([torque[:1], torque]).T:
        size = SMALL_TORQUE / max(float(np.max(np.abs(own))), 1e-9)
        laws = [*r.drum.laws]
        laws[run] = np.column_stack([known, own])
        after = replace(r.drum, laws=laws).residual(run, {**found, size_name: size})
        columns.append((before - after) / size)
    return np.stack(columns, axis=-1)


def speed_sensor(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    """Error of the drum's speed sensor, which also shows in the gear's relation.

    q : at the samples
    """
    xi, inertia = r.values["gear_ratio"], r.values["drum_inertia"]
    speed = LawState(
        values=[one.drum_speed for one in q], time=[one.time for one in q],
        name="drum speed", symbol="w", unit="rad/s", code="value", kind="signed", lags=FILTER_TIMES,
    )  # fmt: skip

    def rows(run: int, values: Array) -> tuple[Array, Array]:
        slope = np.diff(values, axis=0) / np.diff(q[run].time)[:, None]
        level = r.signals[run].noise[NOISES.index("drum_speed")]
        return in_relations({GEAR: inertia / xi}, slope), values / level

    return BenchQuantity(
        place="speed_sensor",
        name="error of the drum's speed sensor",
        unit="rad/s",
        hook="measured_drum_speed",
        states=(speed, time_of(q), _drum_angle(q)),
        rows=rows,
        model=r.model,
    )


def _drum_angle(q: Sequence[BlockQuantities]) -> LawState:
    """Angle of the drum, which lies on either side of its gap to that of the gear."""
    return angle_of(q, [one.drum_speed for one in q], "angle of the drum", "s.drum_speed")
