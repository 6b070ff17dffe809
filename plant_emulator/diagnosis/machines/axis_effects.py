"""The effects of a motor-driven axis beside inertia, viscous and Coulomb friction and an offset.

The nominal force follows from the measured position q, in the axis's own unit (N or N m):

    F = M q'' + F_v q' + F_c sgn q' + F_0

(M. Gautier, A. Janot, P.-O. Vandanjon, IEEE Trans. Control Systems Technology 21 (2013) 428, for
one axis). Each effect is a function from the force so far to the force with the effect, and a table
of its constants. With neutral sizes the force returns unchanged. Friction effects: B.
Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083, section 2. Constants
are in units of what the runs themselves show, so that no effect knows how large an axis is.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from plant_emulator.diagnosis.machines.axis_signals import Motion
    from plant_emulator.signals.log import Array

    Values = Mapping[str, float]
    Law = Callable[[Array, Motion, Values, "Scale"], Array]


@dataclass(frozen=True, kw_only=True)
class Scale:
    """How large an axis is [SI].

    force : rms; speed : highest; middle, travel : middle and half of its travel
    pitch : travel of one revolution of the screw, or of the motor
    sample : sample time of the slowest log [s]
    """

    force: float
    speed: float
    middle: float
    travel: float
    pitch: float
    sample: float


@dataclass(frozen=True, kw_only=True)
class Constant:
    """One constant of an effect.

    neutral : value at which the effect is absent; None: the constant only shapes the effect
    std : prior standard deviation; None: no prior
    of : what the constant is measured in: 1, the rms force, the highest speed, or a sample time
    unit : of a constant that is measured in 1
    """

    plausible: float
    lower: float
    upper: float
    neutral: float | None = None
    std: float | None = None
    of: str = "1"
    unit: str = "1"


@dataclass(frozen=True, kw_only=True)
class AxisEffect:
    """An effect of an axis.

    law : from the force so far to the force with the effect
    title : the effect in one line
    constants : by name
    needs : what a log must have to show the effect; empty where it needs nothing special
    by_direction : nominal friction that the effect splits into one of each direction; empty: none
    """

    law: Law
    title: str
    subsystem: str
    constants: Mapping[str, Constant]
    needs: str = ""
    by_direction: str = ""


def viscous_asymmetry(force: Array, m: Motion, p: Values, _scale: Scale) -> Array:
    """F + a F_v |q'|: viscous friction (1 + a) F_v forwards, (1 - a) F_v backwards."""
    return force + p["viscous_asymmetry_ratio"] * p["viscous_friction"] * np.abs(m.velocity)


def coulomb_asymmetry(force: Array, m: Motion, p: Values, _scale: Scale) -> Array:
    """F + a F_c |sgn q'|: Coulomb friction (1 + a) F_c forwards, (1 - a) F_c backwards.

    For an axis that never rests this is the offset F_0.
    """
    return force + p["coulomb_asymmetry_ratio"] * p["coulomb_friction"] * np.abs(m.direction)


def stribeck(force: Array, m: Motion, p: Values, _scale: Scale) -> Array:
    """F + F_s exp(-(q'/v_s)^2) sgn q': friction rises by F_s towards standstill."""
    share = m.velocity / p["stribeck_speed"]
    return force + p["stribeck_rise"] * np.exp(-share * share) * m.direction


def concave_friction(force: Array, m: Motion, p: Values, scale: Scale) -> Array:
    """F + c sqrt(|q'|/v) sgn q', v the highest speed: friction rises ever slower with speed.

    A square root, a negative square and a negative cube of the speed beside the viscous friction
    differ by less than one run can tell.
    """
    root = np.sqrt(np.abs(m.velocity) / scale.speed)
    return force + p["concave_friction_rise"] * root * m.direction


def position_dependence(force: Array, m: Motion, p: Values, scale: Scale) -> Array:
    """F + (k + d sgn q') x, x the position over half the travel, 0 in its middle.

    k : a force along the travel (spring, weight, cable); d : friction along the travel
    """
    x = (m.position - scale.middle) / scale.travel
    k, d = p["position_dependence_force"], p["position_dependence_friction"]
    return force + (k + d * m.direction) * x


def load_dependence(force: Array, m: Motion, p: Values, _scale: Scale) -> Array:
    """F + mu M |q''| sgn q': friction proportional to the force that accelerates the load."""
    load = p["inertia"] * np.abs(m.acceleration)
    return force + p["load_dependence_ratio"] * load * m.direction


def screw_ripple(force: Array, m: Motion, p: Values, scale: Scale) -> Array:
    """F + s_1 sin phi + c_1 cos phi + s_2 sin 2 phi + c_2 cos 2 phi, phi = 2 pi q / pitch."""
    angle = 2.0 * pi * m.position / scale.pitch
    ripple = p["screw_ripple_sine"] * np.sin(angle) + p["screw_ripple_cosine"] * np.cos(angle)
    ripple += p["screw_ripple_sine_twice"] * np.sin(2.0 * angle)
    ripple += p["screw_ripple_cosine_twice"] * np.cos(2.0 * angle)
    return np.asarray(force + ripple)


def elasticity(force: Array, m: Motion, p: Values, _scale: Scale) -> Array:
    """F + b M (q_2'' - q''), with q_2'' + 2 z w q_2' + w^2 q_2 = 2 z w q' + w^2 q.

    The share b of the inertia hangs on a spring and a damper; w is its natural frequency while the
    motor is held. A bilinear transform that is exact at w gives q_2'' from q''. In a log that is
    too slow for w, nine tenths of the highest possible frequency stand for w.
    """
    from scipy.signal import lfilter

    w, z = min(p["elasticity_frequency"], 0.9 * pi / m.period), p["elasticity_damping"]
    c = 1.0 / np.tan(0.5 * w * m.period)
    upper = np.array([1.0 + 2.0 * z * c, 2.0, 1.0 - 2.0 * z * c])
    lower = np.array([c * c + 2.0 * z * c + 1.0, 2.0 - 2.0 * c * c, c * c - 2.0 * z * c + 1.0])
    follows = lfilter(upper, lower, m.acceleration)
    return force + p["elasticity_share"] * p["inertia"] * (follows - m.acceleration)


def delay(force: Array, m: Motion, p: Values, _scale: Scale) -> Array:
    """F(t + T): the log holds a force T before it acts, as a command does.

    A size is at least one sample: within a sample a command is held, so that a stamp says no more.
    """
    time = m.period * np.arange(len(force))
    return np.asarray(np.interp(time + p["delay_time"], time, force))


def _ratio(plausible: float, lower: float, upper: float) -> Constant:
    return Constant(neutral=0.0, plausible=plausible, lower=lower, upper=upper)


def _force(plausible: float, lower: float, upper: float) -> Constant:
    return Constant(neutral=0.0, plausible=plausible, lower=lower, upper=upper, of="force")


# The library, in the order in which the effects act. The delay is of the whole force: it is last.
EFFECTS: Mapping[str, AxisEffect] = {
    "viscous_asymmetry": AxisEffect(
        law=viscous_asymmetry,
        title="viscous friction differs by direction",
        needs="motion in both directions",
        by_direction="viscous_friction",
        subsystem="gear",
        constants={"ratio": _ratio(0.1, -0.9, 0.9)},
    ),
    "coulomb_asymmetry": AxisEffect(
        law=coulomb_asymmetry,
        title="Coulomb friction differs by direction",
        needs="an offset that is known, not fitted",
        by_direction="coulomb_friction",
        subsystem="gear",
        constants={"ratio": _ratio(0.1, -0.9, 0.9)},
    ),
    "stribeck": AxisEffect(
        law=stribeck,
        title="friction rises towards standstill",
        needs="slow motion",
        subsystem="gear",
        constants={
            "rise": _force(0.05, 0.0, 2.0),
            "speed": Constant(plausible=0.05, std=0.025, lower=0.005, upper=0.3, of="speed"),
        },
    ),
    "concave_friction": AxisEffect(
        law=concave_friction,
        title="friction rises ever slower with speed",
        needs="several speeds",
        subsystem="gear",
        constants={"rise": _force(0.1, 0.0, 2.0)},
    ),
    "position_dependence": AxisEffect(
        law=position_dependence,
        title="force and friction change along the travel",
        subsystem="gear",
        constants={"force": _force(0.05, -2.0, 2.0), "friction": _force(0.05, -2.0, 2.0)},
    ),
    "load_dependence": AxisEffect(
        law=load_dependence,
        title="friction is proportional to the force that accelerates the load",
        needs="several accelerations",
        subsystem="gear",
        constants={"ratio": _ratio(0.05, 0.0, 1.0)},
    ),
    "screw_ripple": AxisEffect(
        law=screw_ripple,
        title="force swings once and twice per revolution",
        subsystem="gear",
        constants={
            "sine": _force(0.02, -0.5, 0.5),
            "cosine": _force(0.02, -0.5, 0.5),
            "sine_twice": _force(0.02, -0.5, 0.5),
            "cosine_twice": _force(0.02, -0.5, 0.5),
        },
    ),
    "elasticity": AxisEffect(
        law=elasticity,
        title="a part of the inertia hangs on a spring",
        needs="accelerations that change quickly",
        subsystem="motor_shaft",
        constants={
            "share": _ratio(0.3, 0.0, 0.95),
            "frequency": Constant(
                plausible=50.0 * pi, std=30.0 * pi, lower=10.0 * pi, upper=120.0 * pi, unit="rad/s"
            ),
            "damping": Constant(plausible=0.1, std=0.1, lower=0.005, upper=0.7),
        },
    ),
    "delay": AxisEffect(
        law=delay,
        title="the force acts later than its log says",
        needs="accelerations that change quickly",
        subsystem="drive",
        constants={
            "time": Constant(neutral=0.0, plausible=2.0, lower=1.0, upper=20.0, of="sample")
        },
    ),
}
