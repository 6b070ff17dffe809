"""The torque sensor's amplifier smooths with a Bessel filter of third order.

    tau^3/15 y''' + 2/5 tau^2 y'' + tau y' + y = T,   T_meas = y

Source: W. E. Thomson, Delay networks having maximally flat frequency characteristics, Proc. IEE 96
(1949) 487. tau: delay of a slow change. tau = 0: no filter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "torque_sensor"
PARAMETERS = {
    "time_constant": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.05, unit="s", meaning="tau"
    ),
}
# The real root of s^3 + 6 s^2 + 15 s + 15 is -REAL, the others are those of s^2 + SUM s + PRODUCT.
REAL = 2.3221853546260856
SUM, PRODUCT = 6.0 - REAL, 15.0 / REAL


def start(p: Record) -> float:
    """Torque [N m] and slope [N m/s] at the start: 0, because the bench starts at rest."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Output of the lag of the real root at the end of an implicit stage of size a [N m]."""
    lag = p.bessel_torque_sensor_time_constant / REAL
    return base if lag == 0.0 else value + (base - value) * (lag / (lag + a))


def slope_of(shown: float, slope: float, a: float, s: Record, p: Record) -> float:
    """Slope of the output of the complex pair of roots at the end of the stage [N m/s]."""
    tau = p.bessel_torque_sensor_time_constant
    force = PRODUCT * (s.bessel_torque_sensor_lagging - shown)
    return (tau * tau * slope + a * force) / (tau * tau + SUM * tau * a + PRODUCT * a * a)


def advance_shown(base: float, a: float, slope: float, s: Record, p: Record) -> float:
    """Output of the filter at the end of the stage [N m]."""
    if p.bessel_torque_sensor_time_constant == 0.0:
        return base
    return base + a * slope_of(base, slope, a, s, p)


def advance_slope(base: float, a: float, shown: float, s: Record, p: Record) -> float:
    """Slope of the filter's output at the end of the stage [N m/s]."""
    if p.bessel_torque_sensor_time_constant == 0.0:
        return base
    return slope_of(shown, base, a, s, p)


MEMORIES = {
    "lagging": Memory(start, advance, follows="measured_shaft_torque"),
    "shown": Memory(start, advance_shown, beside="slope"),
    "slope": Memory(start, advance_slope, beside="shown"),
}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """Measured shaft torque [N m]."""
    if p.bessel_torque_sensor_time_constant == 0.0:
        return value
    return s.bessel_torque_sensor_shown
