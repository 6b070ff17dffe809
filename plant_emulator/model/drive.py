"""The drive: cascade of two PI controllers with limits, and the armature they feed.

Everything the drive does within one implicit stage of size a is a function of the motor speed at
the end of that stage, piecewise linear but for the back-EMF, which is linearised. `armature` finds
current, voltage and integrators there and the slope of the current; the stage in `plant` needs no
more. Thesis, eq. 3.1-3.6, 3.8, 3.12.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.model.laws import converter_voltage_drop

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State

# Step of the current over which a law's slope with it is taken [A].
SHORT_OF_CURRENT = 1e-4

SPEED_INTEGRAL, CURRENT_INTEGRAL, ARMATURE_CURRENT = 0, 1, 2


def limited(value: float, limit: float) -> float:
    """Value held to +-limit [unit of both]."""
    return max(-limit, min(limit, value))


def flux_slope(k_phi: float, s: Record, p: Record) -> float:
    """Slope of the flux with the motor speed [N m s/(A rad)]: 0 below base speed (eq. 3.18).

    Base speed is that of the nominal field: an effect that weakens the flux does not move it.
    """
    divisor = p.flux_constant_2 + abs(s.motor_speed)
    if p.flux_constant_1 / divisor >= p.flux_constant:
        return 0.0
    slope = k_phi / divisor
    return -slope if s.motor_speed > 0.0 else slope


def linearise_drop(s: Record, p: Record) -> None:
    """The converter's voltage drop [V] as offset + slope i, about the present estimate of i [A].

    A drop that is steep at small currents would otherwise take a pass of the stage for every digit.
    """
    current, drop = s.armature_current, converter_voltage_drop(s, p)
    s.converter_drop_offset, s.converter_drop_slope = drop, 0.0
    if drop != 0.0:
        s.armature_current = current + SHORT_OF_CURRENT
        slope = (converter_voltage_drop(s, p) - drop) / SHORT_OF_CURRENT
        s.armature_current = current
        s.converter_drop_offset, s.converter_drop_slope = drop - slope * current, slope


def speed_controller(base: State, a: float, s: Record, p: Record) -> None:
    """Current reference and its slope with the motor speed, at s.motor_speed (eq. 3.2, 3.5, 3.6).

    Conditional integration: at the limit the integrator takes in only error that leads back.
    """
    reference = limited(s.reference, s.speed_limit)
    error = reference - s.tachometer_gain * s.motor_speed
    gain = p.speed_gain * (1.0 + a / p.speed_integral_time)
    integral = base[SPEED_INTEGRAL]
    wanted = p.speed_gain / p.speed_integral_time * integral + gain * error
    s.current_reference = limited(wanted, s.current_limit)
    s.wanted_current = wanted
    s.wanted_current_slope = -gain * s.tachometer_gain
    s.current_reference_slope = s.wanted_current_slope
    share = 1.0
    if s.current_reference != wanted:
        s.current_reference_slope = 0.0
        if error * wanted > 0.0:
            share = s.integration_at_limit
    s.speed_integral_slope = -a * share * s.tachometer_gain
    s.speed_integral = integral + a * share * error


def current_controller(base: State, a: float, s: Record, p: Record) -> None:
    """Armature current, voltage and the current's slope with the motor speed (eq. 3.3, 3.4, 3.8).

    L_a di/dt = u - R_a i - k Phi omega_m - drop, taken implicitly together with the PI controller;
    the drop of an effect's converter as `linearise_drop` left it.
    """
    b = a / p.armature_inductance
    integral = base[CURRENT_INTEGRAL]
    gain = p.current_gain * (1.0 + a / p.current_integral_time)
    offset = p.current_gain / p.current_integral_time * integral
    back_emf = s.flux * s.motor_speed + s.converter_drop_offset
    back_emf_slope = s.flux + s.flux_slope * s.motor_speed
    start = base[ARMATURE_CURRENT]
    resistance = s.resistance + s.converter_drop_slope
    divisor = 1.0 / (1.0 + b * (resistance + gain))
    current = (start + b * (offset + gain * s.current_reference - back_emf)) * divisor
    slope = b * (gain * s.current_reference_slope - back_emf_slope) * divisor
    wanted = offset + gain * (s.current_reference - current)
    voltage = limited(wanted, s.voltage_limit)
    s.wanted_voltage = wanted
    s.wanted_voltage_slope = gain * (s.current_reference_slope - slope)
    share = 1.0
    if voltage != wanted:
        divisor = 1.0 / (1.0 + b * resistance)
        current = (start + b * (voltage - back_emf)) * divisor
        slope = -b * back_emf_slope * divisor
        if (s.current_reference - current) * voltage > 0.0:
            share = s.integration_at_limit
    s.armature_voltage = voltage
    s.armature_current = current
    s.current_slope = slope
    s.current_integral_slope = a * share * (s.current_reference_slope - slope)
    s.current_integral = integral + a * share * (s.current_reference - current)


def armature(base: State, a: float, s: Record, p: Record) -> None:
    """Solve the drive at the motor speed s.motor_speed; everything it finds is written to s."""
    speed_controller(base, a, s, p)
    current_controller(base, a, s, p)


def same_limits(change: float, s: Record) -> bool:
    """Whether the drive is at the same limits when the motor speed changes by `change` [rad/s]."""
    current = s.wanted_current + s.wanted_current_slope * change
    voltage = s.wanted_voltage + s.wanted_voltage_slope * change
    return (abs(current) > s.current_limit) == (abs(s.wanted_current) > s.current_limit) and (
        abs(voltage) > s.voltage_limit
    ) == (abs(s.wanted_voltage) > s.voltage_limit)


def move_drive(change: float, s: Record) -> None:
    """Follow the linearisation to a motor speed that is higher by `change` [rad/s]."""
    s.current_reference += s.current_reference_slope * change
    s.speed_integral += s.speed_integral_slope * change
    s.armature_current += s.current_slope * change
    s.current_integral += s.current_integral_slope * change
    if s.armature_voltage == s.wanted_voltage:
        s.armature_voltage += s.wanted_voltage_slope * change
