"""The torque sensor follows the shaft's torque as a first-order lag.

A term of second order describes a sensor that is not quite of first order:

    q >= 0:   q tau^2 T_meas'' + tau T_meas' + T_meas = T
    q < 0:    (1 - q) tau T_meas' + T_meas = T - q tau T'

Source: K. Ogata, Modern Control Engineering, on systems of first and second order and on lead and
lag. tau is the delay of a slow change for every q. q = 0: first order. q = 0.25: two equal lags.
q > 0.25: the sensor oscillates. q < 0: the share -q / (1 - q) of the torque shows at once. Both
forms agree to first order in q. tau = 0: the sensor shows the torque without a lag.
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
    "second_order": EffectParameter(
        neutral=0.0, lower=-1.0, upper=1.0, plausible=0.0, unit="1", meaning="q", std=0.2
    ),
}


def start(p: Record) -> float:
    """The bench starts at rest: torque [N m] and its slope [N m/s] are zero."""
    return 0.0


def slope_of(shown: float, slope: float, a: float, value: float, p: Record) -> float:
    """Slope of the shown torque at the end of an implicit stage of size a, q > 0 [N m/s].

    shown, slope : bases of the stage
    """
    tau = p.torque_sensor_lag_time_constant
    bend = p.torque_sensor_lag_second_order * tau * tau
    return (bend * slope + a * (value - shown)) / (bend + tau * a + a * a)


def advance(base: float, a: float, value: float, slope: float, s: Record, p: Record) -> float:
    """Shown torque at the end of an implicit stage [N m]; not used at tau = 0."""
    tau, q = p.torque_sensor_lag_time_constant, p.torque_sensor_lag_second_order
    if tau == 0.0:
        return base
    if q > 0.0:
        return base + a * slope_of(base, slope, a, value, p)
    lag = (1.0 - q) * tau
    return value + (base - value) * (lag / (lag + a))


def advance_slope(base: float, a: float, value: float, shown: float, s: Record, p: Record) -> float:
    """Slope of the shown torque at the end of an implicit stage [N m/s]; used for q > 0."""
    if p.torque_sensor_lag_time_constant == 0.0 or p.torque_sensor_lag_second_order <= 0.0:
        return base
    return slope_of(shown, base, a, value, p)


MEMORIES = {
    "shown": Memory(start, advance, follows="measured_shaft_torque", beside="slope"),
    "slope": Memory(start, advance_slope, follows="measured_shaft_torque", beside="shown"),
}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """Shaft torque that the sensor shows [N m]."""
    if p.torque_sensor_lag_time_constant == 0.0:
        return value
    at_once = max(0.0, -p.torque_sensor_lag_second_order)
    if at_once > 0.0:
        return (at_once * value + s.torque_sensor_lag_shown) / (1.0 + at_once)
    return s.torque_sensor_lag_shown
