"""The bench once more: the thesis's equations as they stand, slow and plain.

Shares nothing with `plant_emulator`: numbers typed from Table 3.1, explicit right-hand side, the
sign of the friction smoothed over 1e-6 rad/s, integrated by scipy's LSODA between the corners of
the reference. tests/plant_emulator compare the composed, eliminated, compiled model with this one.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import tanh

import numpy as np
from numpy.typing import NDArray

# Table 3.1, SI
R_a, L_a, J_m = 0.424, 0.004, 0.128
K_m, K_1, K_2 = 1.8506, 366.83, 8.0644
J_g, xi, J_d = 0.02242, 62.6, 312.69
G = 79.3e9
k_mg = G * np.pi / 2 * 0.025**4 / 0.6
k_gd = G * np.pi / 2 * 0.05**4 / 0.577
f_gc, f_g, delta_g = 35.989, 345.38, 0.4418
c, alpha = 1.2032e5, 0.15073
K_ps, T_is, K_pc, T_ic = 15.0, 1.0, 30.0, 3.0
b = 0.063947
u_max, i_max = 400.0, 72.0
omega_max = 4830 * 2 * np.pi / 60
r_d, r_w = 0.645, 0.1715

Array = NDArray[np.float64]
Sign = Callable[[float], float]


def smooth_sign(omega: float) -> float:
    """Sign of a speed [rad/s], smoothed so that an ordinary solver can follow it."""
    return tanh(omega / 1e-6)


def clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def dead_zone(y: float) -> float:
    """Eq. 3.31."""
    if y > alpha:
        return y - alpha
    return y + alpha if y < -alpha else 0.0


def k_phi(omega_m: float) -> float:
    """Eq. 3.16-3.18 [N m/A]."""
    return min(K_m, K_1 / (K_2 + abs(omega_m)))


def friction(omega_g: float, sign: Sign = smooth_sign) -> float:
    """Eq. 3.27 [N m]."""
    return (f_gc + f_g * abs(omega_g) ** delta_g) * sign(omega_g)


def integrating(wanted: float, limit: float, error: float) -> float:
    """Rate of an integrator: its error, but for what would drive a limited output further out."""
    return 0.0 if abs(wanted) > limit and wanted * error > 0.0 else error


def rates(
    x: Sequence[float], reference: float, T_w: float = 0.0, T_f: float | None = None
) -> list[float]:
    """Rates of int e_s, int e_c, i, omega_m, theta_m - xi theta_g, omega_g, theta_g - theta_d,
    omega_d.

    reference : after the dead time [rad/s]; T_w : at the truck's wheel [N m]
    T_f : torque of the gear's friction, where it is not that of the speed (stick) [N m]
    """
    I_s, I_c, i, omega_m, q, omega_g, d, omega_d = x
    e_s = clip(reference, omega_max) - omega_m
    i_wanted = K_ps * (e_s + I_s / T_is)
    e_c = clip(i_wanted, i_max) - i
    u_wanted = K_pc * (e_c + I_c / T_ic)
    T_mg = k_mg * q
    T_gd = k_gd * dead_zone(d + c / k_gd * (omega_g - omega_d))
    T_f = friction(omega_g) if T_f is None else T_f
    return [
        integrating(i_wanted, i_max, e_s),
        integrating(u_wanted, u_max, e_c),
        (clip(u_wanted, u_max) - R_a * i - k_phi(omega_m) * omega_m) / L_a,
        (k_phi(omega_m) * i - T_mg) / J_m,
        omega_m - xi * omega_g,
        (xi * T_mg - T_gd - T_f) / J_g,
        omega_g - omega_d,
        (T_gd + r_d / r_w * T_w) / J_d,
    ]


def simulate(
    corners: Sequence[tuple[float, float]], times: Array, gap_position: float = 0.0
) -> dict[str, Array]:
    """Channels at `times` for a reference that is linear between its corners (s, rad/s)."""
    from scipy.integrate import solve_ivp

    points, speeds = map(np.array, zip(*corners, strict=True))
    x = [0.0] * 8
    x[6] = gap_position * alpha
    size = [1e-2, 1e-2, 1.0, 1.0, 1e-4, 1e-2, 1e-3, 1e-2]
    stops = [times[0], *(p + b for p in points if times[0] < p + b < times[-1]), times[-1]]
    states = np.zeros((len(times), 8))
    states[0] = x
    for start, end in pairwise(stops):
        inside = (times > start) & (times <= end)
        solution = solve_ivp(
            lambda t, x: rates(x, float(np.interp(t - b, points, speeds))),
            (start, end),
            x,
            method="LSODA",
            t_eval=np.union1d(times[inside], [end]),
            rtol=1e-6,
            atol=[1e-6 * s for s in size],
        )
        if not solution.success:
            raise AssertionError(solution.message)
        states[inside] = solution.y.T[: inside.sum()]
        x = list(solution.y[:, -1])
    return {
        "motor_speed": states[:, 3],
        "drum_speed": states[:, 7],
        "armature_current": states[:, 2],
        "shaft_torque": -k_mg * states[:, 4],
    }
