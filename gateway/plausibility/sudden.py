"""A sudden fault of torque sensor or current, against what the bench has shown before (pure).

Drifted parameters make the motor's balance wrong by a share of its torque, for hours. Their part
stands in the slow mean of the residual, and a change of the torque changes it by a share of that
change only. So the residual less its slow mean has a closer tolerance than the residual itself.

A wrong gain of the torque sensor is an error that follows its own torque, and a loop that answers
to it swings through zero. The product of both does not. The drive's ripple, of which a poll sees
one moment a scan, changes its sign from scan to scan and shows in both. So the product takes means
over three windows: of the torque equal ones, because they pass nothing of a period of three scans,
and of the residual binomial ones, because they pass more of a slower swing.
"""

from dataclasses import dataclass
from math import exp
from statistics import fmean

SLOW, SMOOTH, FADE, RISE = 1.0, 0.1, 0.3, 0.5
"""[s] Time constants of the slow means, of the torque whose distance to its slow mean is the
change, of a large change that fades, and of the mean acceleration."""
SCANS, BINOMIAL = 3, (1.0, 2.0, 1.0)
"""Windows of a mean without the ripple, in which the product and an impact are seen; and weights
[1] of the residual's mean."""
RIPPLE, DRIVING, PULSES = 1.3, 2.0, 0.04
"""[1] Tolerance of a sudden change over that of the balance itself: of a steady torque, because the
drive answers to the noise in the setpoint with a current of which a poll knows one moment a scan;
and with the changes that this noise makes all the time. Further tolerance by the acceleration of
the motor [N m s^2/rad]: a setpoint that rises drives larger pulses of current."""
PRODUCT_SHARE, PRODUCT_LEVEL = 1.5, 0.8
"""[1] Tolerance of the product over the share of the balance, because its two means are of the same
windows; and its alarm level over that of Page's law, because the product is small where the torque
is: 50 drifted benches let expect 0.1 alarms in 100 hours."""
LIGHT, HIT = 2.0, 10.0
"""Torque over the tolerance of the balance [1] below which the product's tolerance no longer falls,
because a motor that rattles in the backlash shows torque and current in the same pulses; and change
of both torques [N m] from which on the flanks have met at speed."""


@dataclass(frozen=True, kw_only=True)
class Steady:
    """What the bench has shown of late.

    since : time over which the slow means are taken [s]
    residual, torque : slow means of the motor's balance, and of its torque [N m]
    smooth, change : motor's torque smoothed, and its distance to the slow mean, fading [N m]
    rise : mean acceleration of the motor [rad/s^2]
    motor, shown, sudden : of the last windows, torque of the motor and of the sensor, and the
        residual less its slow mean [N m]
    """

    since: float = 0.0
    residual: float = 0.0
    torque: float = 0.0
    smooth: float = 0.0
    change: float = 0.0
    rise: float = 0.0
    motor: tuple[float, ...] = ()
    shown: tuple[float, ...] = ()
    sudden: tuple[float, ...] = ()


def note(
    state: Steady,
    residual: float,
    torque: float,
    duration: float,
    *,
    shown: float,
    rise: float,
    largest: float,
) -> Steady:
    """Return the means after one more window: residual, motor's torque [N m], duration [s].

    shown : torque of the sensor over the window [N m]; rise : acceleration of the motor [rad/s^2]
    largest : residual that drifted parameters may cause, so that no fault gets into its mean [N m]
    Until SLOW has passed, the slow means are those of all windows.
    """
    since = state.since + duration
    weight = max(1.0 - exp(-duration / SLOW), duration / since)
    residual_mean = state.residual + weight * (residual - state.residual)
    slow = state.torque + weight * (torque - state.torque)
    motor, both = (*state.motor, torque)[-SCANS:], (*state.shown, shown)[-SCANS:]
    # Flanks that meet move both torques at once; a sensor that fails moves its own alone.
    impact = min(abs(fmean(motor) - slow), abs(fmean(both) + slow))
    smooth = torque + (state.smooth - torque) * exp(-duration / SMOOTH)
    return Steady(
        since=since,
        residual=min(max(residual_mean, -largest), largest),
        torque=slow,
        smooth=smooth,
        change=max(
            state.change * exp(-duration / FADE), abs(smooth - slow), impact * (impact > HIT)
        ),
        rise=rise + (state.rise - rise) * exp(-duration / RISE),
        motor=motor,
        shown=both,
        sudden=(*state.sudden, residual - state.residual)[-SCANS:],
    )


def tolerance(state: Steady, torque: float, share: float) -> float:
    """Tolerance of a sudden change of the motor's balance [N m].

    torque, share : tolerance of the balance [N m], and its share of the motor's torque [1]
    """
    return RIPPLE * torque + share * state.change + PULSES * abs(state.rise)


def product(state: Steady, torque: float, share: float) -> tuple[float, float]:
    """Mean of the sudden residual times mean torque, and its tolerance [N^2 m^2].

    torque, share : as for `tolerance`
    """
    shown = fmean(state.shown)
    sudden = fmean(state.sudden, BINOMIAL[-len(state.sudden) :])
    allowed = PRODUCT_SHARE * share * max(abs(shown), LIGHT * torque) ** 2
    return sudden * shown, allowed + PULSES * abs(state.rise * shown)
