"""The drive: two PI controllers in cascade, their limits, and the armature circuit that they feed.

The drive is solved within one implicit stage of size a. Its current is then a function of the motor
speed at the end of that stage. This function is piecewise linear except for the back-EMF, which is
linearised. `solve_drive` finds current, voltage and integrators at one motor speed, and the slope
of the current with it. `implicit_stage` needs no more. Source: thesis, eq. 3.1-3.6, 3.8, 3.12.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.model.laws import converter_voltage_drop, current_limit

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State

# Change of the current over which the slope of the converter's voltage drop is taken [A].
SHORT_OF_CURRENT = 1e-4

SPEED_INTEGRAL, CURRENT_INTEGRAL, ARMATURE_CURRENT = 0, 1, 2


def clamp(value: float, limit: float) -> float:
    """Clamp a value to the range from -limit to +limit [unit of both]."""
    return max(-limit, min(limit, value))


def flux_slope(k_phi: float, s: Record, p: Record) -> float:
    """Slope of the flux with the motor speed [N m s/(A rad)]: 0 below base speed (eq. 3.18).

    Base speed is that of the nominal field. An effect that weakens the flux does not move it.
    """
    divisor = p.flux_constant_2 + abs(s.motor_speed)
    if p.flux_constant_1 / divisor >= p.flux_constant:
        return 0.0
    slope = k_phi / divisor
    return -slope if s.motor_speed > 0.0 else slope


def linearise_drop(s: Record, p: Record) -> None:
    """Linearise the converter's voltage drop about the current: offset [V] + slope [ohm] i [A].

    A drop can be steep at small currents. Without this line the stage would need one pass for each
    digit of the current.
    """
    current, drop = s.armature_current, converter_voltage_drop(s, p)
    s.converter_drop_offset, s.converter_drop_slope = drop, 0.0
    if drop != 0.0:
        s.armature_current = current + SHORT_OF_CURRENT
        slope = (converter_voltage_drop(s, p) - drop) / SHORT_OF_CURRENT
        s.armature_current = current
        s.converter_drop_offset, s.converter_drop_slope = drop - slope * current, slope


def integrate_to_limit(full: float, held: float, above: float) -> float:
    """The state of an integrator whose controller is limited, at the end of a stage.

    While the controller is limited, an integrator with conditional integration stands still; below
    the limit it takes in the error. Where it would leave the limit standing, and exceed it going
    on, it does neither: it slides along the limit (A. F. Filippov, Differential Equations with
    Discontinuous Righthand Sides, section 4). It takes in what brings the controller to its limit.

    full, held : state with all of the error, and with the share that it takes in at the limit
    above : what the controller exceeds its limit by with the full state, as a state; its sign is
        that of the error
    """
    return max(held, full - above) if above > 0.0 else min(held, full - above)


def solve_speed_loop(base: State, a: float, s: Record, p: Record) -> None:
    """Write the current reference at s.motor_speed, and its slope with it (eq. 3.2, 3.5, 3.6).

    Anti-windup by conditional integration: while the current reference is limited, the integrator
    takes in only an error that leads away from the limit. A limit with a rounded corner sets in
    below its value; an integrator that is held there stays held.

    base : states that the stage starts from; a : implicit step [s]
    """
    reference = clamp(s.reference, s.speed_limit)
    error = reference - s.tachometer_gain * s.motor_speed
    gain = p.speed_gain * (1.0 + a / p.speed_integral_time)
    integral = base[SPEED_INTEGRAL]
    wanted = p.speed_gain / p.speed_integral_time * integral + gain * error
    s.current_reference = clamp(wanted, s.current_limit)
    s.wanted_current = wanted
    s.wanted_current_slope = -gain * s.tachometer_gain
    s.current_reference_slope = s.wanted_current_slope
    s.speed_integral = integral + a * error
    s.speed_integral_slope = -a * s.tachometer_gain
    s.current_at_hold = wanted
    s.current_at_hold_slope = s.wanted_current_slope
    if s.current_reference != wanted:
        s.current_reference_slope = 0.0
        if error * wanted > 0.0:
            taken = a * s.integration_at_limit
            per_integral = p.speed_gain / p.speed_integral_time
            held = integral + taken * error
            s.current_at_hold = wanted - per_integral * (a - taken) * error
            s.current_at_hold_slope += per_integral * (a - taken) * s.tachometer_gain
            above = (wanted - s.current_reference) / per_integral
            s.speed_integral = integrate_to_limit(s.speed_integral, held, above)
            s.wanted_current = s.current_at_hold
            if abs(s.current_at_hold) > current_limit(s, p):
                s.speed_integral = held
            s.wanted_current = wanted
            s.speed_integral_slope = -taken * s.tachometer_gain
            if s.speed_integral != held:
                s.speed_integral_slope = p.speed_integral_time * s.tachometer_gain


def solve_current_loop(base: State, a: float, s: Record, p: Record) -> None:
    """Write armature current, voltage and the current's slope with the motor speed.

    L_a di/dt = u - R_a i - k Phi omega_m - drop                    (thesis, eq. 3.3, 3.4, 3.8)

    This equation and the PI controller are solved together, implicitly. The drop is the converter's
    voltage drop as `linearise_drop` left it.

    base : states that the stage starts from; a : implicit step [s]
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
    voltage = clamp(wanted, s.voltage_limit)
    s.wanted_voltage = wanted
    s.wanted_voltage_slope = gain * (s.current_reference_slope - slope)
    if voltage != wanted:
        divisor = 1.0 / (1.0 + b * resistance)
        current = (start + b * (voltage - back_emf)) * divisor
        slope = -b * back_emf_slope * divisor
    error, error_slope = s.current_reference - current, s.current_reference_slope - slope
    s.armature_voltage = voltage
    s.armature_current = current
    s.current_slope = slope
    s.current_integral = integral + a * error
    s.current_integral_slope = a * error_slope
    s.voltage_at_hold = wanted
    s.voltage_at_hold_slope = s.wanted_voltage_slope
    if voltage != wanted and error * voltage > 0.0:
        taken = a * s.integration_at_limit
        per_integral = p.current_gain / p.current_integral_time
        held = integral + taken * error
        above = (offset + gain * error - voltage) / per_integral
        s.current_integral = integrate_to_limit(s.current_integral, held, above)
        s.current_integral_slope = taken * error_slope
        if s.current_integral != held:
            s.current_integral_slope = -p.current_integral_time * error_slope
        at_hold = gain - per_integral * (a - taken)
        s.voltage_at_hold = offset + at_hold * error
        s.voltage_at_hold_slope = at_hold * error_slope


def solve_drive(base: State, a: float, s: Record, p: Record) -> None:
    """Solve the drive at the motor speed s.motor_speed [rad/s] and write the result to s.

    base : states at the begin of the implicit stage; a : size of the stage [s]
    """
    solve_speed_loop(base, a, s, p)
    solve_current_loop(base, a, s, p)


def stays_limited(value: float, change: float, limit: float) -> bool:
    """Whether a value stays within a limit, or beyond it, when it changes."""
    return (abs(value + change) > limit) == (abs(value) > limit)


def keeps_limits(change: float, s: Record) -> bool:
    """Whether the drive keeps its limits when the motor speed changes by `change` [rad/s].

    An integrator keeps to its limit if its controller exceeds the limit even while it is held.
    """
    return (
        stays_limited(s.wanted_current, s.wanted_current_slope * change, s.current_limit)
        and stays_limited(s.current_at_hold, s.current_at_hold_slope * change, s.current_limit)
        and stays_limited(s.wanted_voltage, s.wanted_voltage_slope * change, s.voltage_limit)
        and stays_limited(s.voltage_at_hold, s.voltage_at_hold_slope * change, s.voltage_limit)
    )


def move_drive(change: float, s: Record) -> None:
    """Move the drive along its linearisation by a change of the motor speed [rad/s]."""
    s.current_reference += s.current_reference_slope * change
    s.speed_integral += s.speed_integral_slope * change
    s.armature_current += s.current_slope * change
    s.current_integral += s.current_integral_slope * change
    if s.armature_voltage == s.wanted_voltage:
        s.armature_voltage += s.wanted_voltage_slope * change
