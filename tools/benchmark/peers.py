"""A second model of the nominal bench, for general solvers: scipy's LSODA and CasADi's CVODES.

This model is written from the equations of the thesis (LiTH-ISY-EX--17/5092--SE, chapter 3). It is
independent of the emulator's own laws, drive and plant: both share only the parameter values. A
general solver needs a right-hand side without jumps. Hence the sign in the gear's friction is a
tanh with a width of 1e-4 rad/s. Limits, conditional integration and dead zone are exact.

States: 0 integral of the speed error [rad], 1 integral of the current error [A s], 2 armature
current [A], 3 motor speed, 4 twist of the motor shaft, 5 gear speed, 6 twist of the drum shaft
with its gap, 7 drum speed [rad, rad/s].
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from math import tanh
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = Mapping[str, float]
Corners = Sequence[tuple[float, float]]
RightHandSide = Callable[[float, Array], list[float]]

STATES = 8
SMOOTHED_OVER = 1e-4
# The power |omega_g|^delta_g has no finite slope at rest; a Jacobian needs one [rad/s].
SMALLEST_SPEED = 1e-9
# Longest step [s]: at rest all derivatives vanish, and a free step would leap over the whole run.
LARGEST_STEP = 0.5
# Absolute tolerance over relative tolerance [the unit of each state].
ABSOLUTE = 1e-2
# Columns of the result of each solver.
CHANNELS = ("motor_speed", "drum_speed", "armature_current", "shaft_torque")


def channels(states: Array, p: Values) -> Array:
    """The measured channels, shape (n, CHANNELS), of the states, shape (n, STATES)."""
    torque = -p["motor_shaft_stiffness"] * states[:, 4]
    return np.column_stack((states[:, 3], states[:, 7], states[:, 2], torque))


def delayed(corners: Corners, p: Values) -> tuple[Array, Array]:
    """Times [s] and speeds [rad/s] of the corners of the reference, after the drive's dead time."""
    time, speed = np.array(corners).T
    return time + p["dead_time"], speed


def plain(corners: Corners, p: Values) -> RightHandSide:
    """f(t, x) as one writes it with NumPy."""
    times, speeds = delayed(corners, p)
    f = right_hand_side(p)
    return lambda t, x: f(np.interp(t, times, speeds), *x)


def tuned(corners: Corners, p: Values) -> RightHandSide:
    """f(t, x) as fast as plain Python gets: floats only, and a bisection for the reference."""
    times, speeds = (column.tolist() for column in delayed(corners, p))
    points = zip(times, speeds, strict=True)
    slopes = [(v1 - v0) / (t1 - t0) for (t0, v0), (t1, v1) in pairwise(points)]
    f, last = right_hand_side(p), len(slopes) - 1

    def g(t: float, x: Array) -> list[float]:
        k = min(max(bisect(times, t) - 1, 0), last)
        return f(speeds[k] + slopes[k] * max(t - times[k], 0.0), *x.tolist())

    return g


def right_hand_side(p: Values) -> Callable[..., list[float]]:
    """A function (reference, states) -> derivatives, with its constants bound beforehand."""
    r_a, l_a, j_m = p["armature_resistance"], p["armature_inductance"], p["motor_inertia"]
    k_m, k_1, k_2 = p["flux_constant"], p["flux_constant_1"], p["flux_constant_2"]
    k_mg, xi, j_g = p["motor_shaft_stiffness"], p["gear_ratio"], p["gear_inertia"]
    f_gc, f_g = p["gear_coulomb_friction"], p["gear_viscous_friction"]
    delta_g, alpha = p["gear_friction_exponent"], p["backlash_half_gap"]
    k_gd, j_d = p["drum_shaft_stiffness"], p["drum_inertia"]
    c_over_k = p["drum_shaft_damping"] / k_gd
    k_s, k_c = p["speed_gain"], p["current_gain"]
    k_is, k_ic = k_s / p["speed_integral_time"], k_c / p["current_integral_time"]
    i_max, u_max, speed_max = p["armature_current_limit"], p["voltage_limit"], p["speed_limit"]

    def f(
        r: float,
        int_s: float,
        int_c: float,
        i: float,
        omega_m: float,
        q: float,
        omega_g: float,
        d: float,
        omega_d: float,
    ) -> list[float]:
        # speed controller (eq. 3.2, 3.5, 3.6)
        e_s = max(-speed_max, min(speed_max, r)) - omega_m
        i_wanted = k_s * e_s + k_is * int_s
        i_ref = max(-i_max, min(i_max, i_wanted))
        # current controller (eq. 3.3, 3.4)
        e_c = i_ref - i
        u_wanted = k_c * e_c + k_ic * int_c
        u = max(-u_max, min(u_max, u_wanted))
        # motor with field weakening (eq. 3.8-3.18)
        k_phi = min(k_m, k_1 / (k_2 + abs(omega_m)))
        t_mg = k_mg * q
        # gear friction (eq. 3.27) and the shaft with backlash (eq. 3.29-3.31)
        t_f = (f_gc + f_g * abs(omega_g) ** delta_g) * tanh(omega_g / SMOOTHED_OVER)
        twist = d + c_over_k * (omega_g - omega_d)
        t_gd = k_gd * (twist - max(-alpha, min(alpha, twist)))
        return [
            0.0 if i_wanted != i_ref and e_s * i_wanted > 0.0 else e_s,
            0.0 if u_wanted != u and e_c * u_wanted > 0.0 else e_c,
            (u - r_a * i - k_phi * omega_m) / l_a,
            (k_phi * i - t_mg) / j_m,
            omega_m - xi * omega_g,
            (xi * t_mg - t_gd - t_f) / j_g,
            omega_g - omega_d,
            t_gd / j_d,
        ]

    return f


class Lsoda:
    """scipy's solve_ivp with LSODA and a right-hand side in Python, `plain` or `tuned`."""

    def __init__(self, time: Array, right_hand_side: RightHandSide, p: Values) -> None:
        self._time, self._p = time, p
        self._f = right_hand_side

    def __call__(self, tolerance: float, backlash_angle: float = 0.0) -> Array:
        """The channels at the sample times, shape (n, CHANNELS), at this relative tolerance.

        backlash_angle : angle of the gear minus angle of the drum at the start [rad]
        """
        from scipy.integrate import solve_ivp

        start = np.zeros(STATES)
        start[6] = backlash_angle
        found = solve_ivp(
            self._f,
            (self._time[0], self._time[-1]),
            start,
            method="LSODA",
            max_step=LARGEST_STEP,
            t_eval=self._time,
            rtol=tolerance,
            atol=tolerance * ABSOLUTE,
        )
        return channels(found.y.T, self._p)


class Cvodes:
    """CasADi's interface to CVODES, right-hand side and Jacobian from its expression graph."""

    def __init__(self, time: Array, corners: Corners, p: Values) -> None:
        self._time, self._p, self._corners = time, p, corners
        self._solvers: dict[float, Any] = {}

    def __call__(self, tolerance: float) -> Array:
        """The channels at the sample times, shape (n, CHANNELS), at this relative tolerance."""
        if tolerance not in self._solvers:
            self._solvers[tolerance] = self._solver(tolerance)
        states = np.array(self._solvers[tolerance](x0=np.zeros(STATES))["xf"]).T
        return channels(states, self._p)

    def _solver(self, tolerance: float) -> Any:
        import casadi as ca

        options = {"reltol": tolerance, "abstol": tolerance * ABSOLUTE, "max_num_steps": 1_000_000}
        problem = symbolic(self._corners, self._p)
        return ca.integrator("bench", "cvodes", problem, 0.0, self._time, options)


def symbolic(corners: Corners, p: Values) -> dict[str, Any]:
    """The equations as a CasADi problem: time, states and derivatives."""
    import casadi as ca

    t, x = ca.SX.sym("t"), ca.SX.sym("x", STATES)
    int_s, int_c, i, omega_m, q, omega_g, d, omega_d = ca.vertsplit(x)

    def limited(value: Any, limit: float) -> Any:
        return ca.fmax(-limit, ca.fmin(limit, value))

    times, speeds = delayed(corners, p)
    reference = ca.pw_lin(t, times, speeds)
    e_s = limited(ca.if_else(t < times[0], speeds[0], reference), p["speed_limit"]) - omega_m
    i_wanted = p["speed_gain"] * (e_s + int_s / p["speed_integral_time"])
    i_ref = limited(i_wanted, p["armature_current_limit"])
    e_c = i_ref - i
    u_wanted = p["current_gain"] * (e_c + int_c / p["current_integral_time"])
    u = limited(u_wanted, p["voltage_limit"])
    weakened = p["flux_constant_1"] / (p["flux_constant_2"] + ca.fabs(omega_m))
    k_phi = ca.fmin(p["flux_constant"], weakened)
    t_mg = p["motor_shaft_stiffness"] * q
    viscous = (
        p["gear_viscous_friction"]
        * (ca.fabs(omega_g) + SMALLEST_SPEED) ** p["gear_friction_exponent"]
    )
    t_f = (p["gear_coulomb_friction"] + viscous) * ca.tanh(omega_g / SMOOTHED_OVER)
    twist = d + p["drum_shaft_damping"] / p["drum_shaft_stiffness"] * (omega_g - omega_d)
    t_gd = p["drum_shaft_stiffness"] * (twist - limited(twist, p["backlash_half_gap"]))
    ode = ca.vertcat(
        ca.if_else(ca.logic_and(i_wanted != i_ref, e_s * i_wanted > 0.0), 0.0, e_s),
        ca.if_else(ca.logic_and(u_wanted != u, e_c * u_wanted > 0.0), 0.0, e_c),
        (u - p["armature_resistance"] * i - k_phi * omega_m) / p["armature_inductance"],
        (k_phi * i - t_mg) / p["motor_inertia"],
        omega_m - p["gear_ratio"] * omega_g,
        (p["gear_ratio"] * t_mg - t_gd - t_f) / p["gear_inertia"],
        omega_g - omega_d,
        t_gd / p["drum_inertia"],
    )
    return {"t": t, "x": x, "ode": ode}
