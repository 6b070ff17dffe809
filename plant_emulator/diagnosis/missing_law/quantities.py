"""The quantities of the bench in which a law may be missing, from the drive to the gear."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.measured_signals import interval_means
from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    MOTOR,
    ROWS,
    speed_error,
)
from plant_emulator.diagnosis.missing_law.drum_quantities import (
    drum_friction,
    drum_weight,
    speed_sensor,
)
from plant_emulator.diagnosis.missing_law.quantity import (
    BenchQuantity,
    angle_of,
    in_relations,
    rows_in_relations,
    time_of,
)
from plant_emulator.diagnosis.missing_law.states import FILTER_TIMES, WARMING_TIMES, LawState
from plant_emulator.model.array_laws import gear_friction

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.localisation.block_basis import BlockQuantities
    from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
    from plant_emulator.signals.log import Array


def quantities(regression: BlockRegression) -> list[BenchQuantity]:
    """All quantities of the bench that its logs can tell of."""
    q = regression.quantities
    found = [
        _gear(regression, q),
        drum_friction(regression, q),
        drum_weight(regression, q),
        _motor(regression, q),
        _flux(regression, regression.samples),
        _torque_sensor(regression, regression.samples),
        speed_sensor(regression, regression.samples),
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
    speeds = [one.speed / xi for one in q]
    angle = angle_of(q, speeds, "angle of the gear's output", "s.gear_speed")
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
    """Flux of the motor; q : at the samples, because a ripple turns far from one to the next.

    Where the voltage is not logged, the drive's relation takes it from the current and the flux.
    """
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

    def rows(run: int, values: Array) -> tuple[Array, None]:
        torque, voltage = (by[:, None] * values for by in (q[run].current, q[run].speed))
        found = np.zeros((ROWS, len(values) - 1, values.shape[1]))
        found[MOTOR], found[ARMATURE] = interval_means(torque), interval_means(voltage)
        if r.signals[run].voltage is None:
            found[DRIVE] = -interval_means(speed_error(voltage, q[run].time, r.values))
        return found, None

    return BenchQuantity(
        place="motor",
        name="flux of the motor",
        unit="N m/A",
        hook="flux",
        states=(current, speed, time_of(q), flux, _motor_angle(q)),
        rows=rows,
        model=r.model,
    )


def _torque_sensor(r: BlockRegression, q: Sequence[BlockQuantities]) -> BenchQuantity:
    """Error of the torque sensor; q : at the samples, of which the relations take the means."""
    xi = r.values["gear_ratio"]
    torque = LawState(
        values=[-(one.load + gear_friction(one.speed / xi, r.values)) / xi for one in q],
        time=[one.time for one in q],
        name="shaft torque", symbol="T", unit="N m", code="value", kind="signed", lags=FILTER_TIMES,
    )  # fmt: skip

    def rows(run: int, values: Array) -> tuple[Array, None]:
        del run
        return in_relations({MOTOR: -1.0, GEAR: 1.0}, interval_means(values)), None

    return BenchQuantity(
        place="torque_sensor",
        name="error of the torque sensor",
        unit="N m",
        hook="measured_shaft_torque",
        states=(torque, time_of(q), _motor_angle(q)),
        rows=rows,
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


def _motor_angle(q: Sequence[BlockQuantities]) -> LawState:
    return angle_of(q, [one.speed for one in q], "angle of the motor", "s.motor_speed")
