"""The quantities of the bench in which a law may be missing, from the drive to the gear."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.parity_relations import ARMATURE, DRIVE, GEAR, MOTOR
from plant_emulator.diagnosis.missing_law.drum_quantities import (
    drum_friction,
    drum_weight,
    speed_sensor,
)
from plant_emulator.diagnosis.missing_law.quantity import BenchQuantity, rows_in_relations, time_of
from plant_emulator.diagnosis.missing_law.states import FILTER_TIMES, WARMING_TIMES, LawState
from plant_emulator.model.array_laws import gear_friction

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.localisation.block_basis import BlockQuantities
    from plant_emulator.diagnosis.localisation.block_regression import BlockRegression


def quantities(regression: BlockRegression) -> list[BenchQuantity]:
    """All quantities of the bench that its logs can tell of."""
    q = regression.quantities
    found = [
        _gear(regression, q),
        drum_friction(regression, q),
        drum_weight(regression, q),
        _motor(regression, q),
        _flux(regression, q),
        _torque_sensor(regression, q),
        speed_sensor(regression, q),
        _reference(regression, q),
    ]
    if any(m.voltage is not None for m in regression.signals):
        found.append(_voltage(regression, q))
    return found


def _gear(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    xi = r.values["gear_ratio"]
    speed = LawState(
        values=[np.abs(one.speed) / xi for one in q], time=[one.time for one in q],
        name="gear speed", symbol="w", unit="rad/s", code="abs(s.gear_speed)", kind="level",
        lags=WARMING_TIMES,
    )  # fmt: skip
    load = LawState(
        values=[one.load * one.moving for one in q], time=[one.time for one in q],
        name="torque to the drum along the motion", symbol="T", unit="N m",
        code="s.drum_shaft_torque * s.gear_direction", kind="signed",
    )  # fmt: skip
    angle = LawState(
        values=[one.angle for one in q], time=[one.time for one in q],
        name="angle of the gear's output", symbol="theta", unit="rad", code="s.gear_speed",
        kind="angle",
    )  # fmt: skip
    direction = LawState(
        values=[one.moving for one in q], time=[one.time for one in q],
        name="direction", symbol="d", unit="", code="s.gear_direction", kind="direction",
    )  # fmt: skip
    return BenchQuantity(
        place="gear",
        name="friction of the gear at its output",
        unit="N m",
        hook="gear_speed_friction",
        states=(speed, load, direction, time_of(q), angle),
        rows=rows_in_relations({GEAR: [-one.moving / xi for one in q]}),
        model=r.model,
    )


def _motor(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    speed = LawState(
        values=[np.abs(one.speed) for one in q], time=[one.time for one in q],
        name="motor speed", symbol="w", unit="rad/s", code="abs(s.motor_speed)", kind="level",
    )  # fmt: skip
    return BenchQuantity(
        place="motor",
        name="friction of the motor",
        unit="N m",
        hook="motor_coulomb_friction",
        states=(speed, time_of(q)),
        rows=rows_in_relations({MOTOR: [-one.moving for one in q]}),
        model=r.model,
    )


def _flux(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    current = LawState(
        values=[np.abs(one.current) for one in q], time=[one.time for one in q],
        name="size of the armature current", symbol="i", unit="A", code="abs(s.armature_current)",
        kind="level",
    )  # fmt: skip
    speed = LawState(
        values=[np.abs(one.speed) for one in q], time=[one.time for one in q],
        name="motor speed", symbol="w", unit="rad/s", code="abs(s.motor_speed)", kind="level",
    )  # fmt: skip
    flux = LawState(
        values=[one.flux for one in q], time=[one.time for one in q],
        name="flux", symbol="kPhi", unit="N m/A", code="value", kind="followed", lags=FILTER_TIMES,
        start="p.flux_constant",
    )  # fmt: skip
    weights = {MOTOR: [one.current for one in q], ARMATURE: [one.speed for one in q]}
    return BenchQuantity(
        place="motor",
        name="flux of the motor",
        unit="N m/A",
        hook="flux",
        states=(current, speed, time_of(q), flux),
        rows=rows_in_relations(weights),
        model=r.model,
    )


def _torque_sensor(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    xi = r.values["gear_ratio"]
    torque = LawState(
        values=[-(one.load + gear_friction(one.speed / xi, r.values)) / xi for one in q],
        time=[one.time for one in q],
        name="shaft torque", symbol="T", unit="N m", code="value", kind="signed", lags=FILTER_TIMES,
    )  # fmt: skip
    return BenchQuantity(
        place="torque_sensor",
        name="error of the torque sensor",
        unit="N m",
        hook="measured_shaft_torque",
        states=(torque, time_of(q)),
        rows=rows_in_relations({MOTOR: -1.0, GEAR: 1.0}),
        model=r.model,
    )


def _reference(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    reference = LawState(
        values=[one.demand for one in q], time=[one.time for one in q],
        name="speed reference", symbol="r", unit="rad/s", code="value", kind="signed",
        lags=FILTER_TIMES,
    )  # fmt: skip
    current = LawState(
        values=[one.current for one in q], time=[one.time for one in q],
        name="armature current", symbol="i", unit="A", code="s.armature_current", kind="smooth",
    )  # fmt: skip
    return BenchQuantity(
        place="drive",
        name="speed reference inside the drive",
        unit="rad/s",
        hook="reference",
        states=(reference, current, time_of(q)),
        rows=rows_in_relations({DRIVE: 1.0}),
        model=r.model,
    )


def _voltage(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    current = LawState(
        values=[one.current for one in q], time=[one.time for one in q],
        name="armature current", symbol="i", unit="A", code="s.armature_current", kind="smooth",
    )  # fmt: skip
    return BenchQuantity(
        place="drive",
        name="voltage between drive and armature",
        unit="V",
        hook="converter_voltage_drop",
        states=(current, time_of(q)),
        rows=rows_in_relations({ARMATURE: 1.0}),
        model=r.model,
    )
