"""Plausibility of the sensors from the model: parity relations in every window (pure).

Each relation holds for every driver and truck, and its residual is an impulse or an angle over the
window between two samples.

Motor. Torque of the current, torque of the shaft and acceleration of the motor balance:

    e_1 = integral (k Phi i + T_meas) dt - J_m (omega_m2 - omega_m1)        (thesis, eq 3.9, 3.26)

Gear. Motor and drum move apart by no more than the backlash, 2 alpha at the gear output:

    e_2 = integral (omega_m / xi - omega_d) dt                             (thesis, eq 3.31)

Drum. The rest of the torques on the drum is that of the truck, which has a limit:

    e_3 = (J_g + J_d) (omega_d2 - omega_d1) + integral (xi T_meas + T_f) dt     (thesis, eq 4.9)

Two relations hold more closely for a while. A sudden fault shows against the slow mean of e_1, in
which drifted parameters stand; only their share of a change of the torque is left:

    e_4 = e_1 - integral (slow mean of e_1) dt
    e_6 = integral (e_4 / dt) T_meas dt, with means over three windows

While the gear pushes the motor, the flanks are in contact and the backlash is closed. The sensor
then shows a torque that no friction of a free gear can make, whatever its size, because friction
has the other sign (the bench turns forward only):

    e_5 = e_2 since T_meas > T_c

A CUSUM adds up each residual beyond its tolerance, for either sign: S = max(0, S + e - k dt). The
tolerance k covers drifted parameters and neglected effects. The alarm level covers the noise; it
follows from the rate of false alarms that is allowed. That of the motor's balance is the noise that
this bench has shown of late. Speeds enter e_3 as differences, so that the noise of a sum is that of
its two ends.

A torque sensor that stands still to the last bit at some value, while the current moves, is stuck.
If the sensors are known to be noisy, the noise of its partner is move enough, also for a speed
sensor: without noise, one side moves alone inside the backlash.
"""

from dataclasses import dataclass, field
from math import copysign, exp, inf

from gateway.friction.law import friction_torque
from gateway.plausibility import balance_noise
from gateway.plausibility.balance_noise import BalanceNoise
from gateway.plausibility.stuck import Streak, follow, is_stuck
from gateway.plausibility.sudden import DRIVING, Steady, note, product, tolerance
from gateway.plausibility.tolerances import Params
from gateway.reasons import Reason
from register_maps.signals import Measurement, Status
from register_maps.timing import SCAN

SMOOTHING_TIME, ENVELOPE, RISE = 0.05, 0.3, 0.1
"""[s] The tolerance follows the mean torque over the first time, because a wrong gain cancels in a
ripple. It remembers a large mean for the second time, because shafts ring and fluxes lag. The third
time smoothes the acceleration."""
PULSES = 0.08
"""[N m s^2/rad] Further tolerance of the motor's torque by its acceleration: a setpoint that rises
in steps drives pulses of current, of which a poll sees only one moment."""
SETTLED_CONTACT = 0.2
"""[s] Time for which the gear pushes until the flanks no longer bounce."""
REACTION = 0.25
"""Further share of the motor's torque at the full torque, where the current weakens the field."""
COARSE_STEP = 4.0
"""[N m] Further tolerance of the motor's torque for each scan between two polls, at which alone the
current is known."""
CUSUM_CEILING = 1.02
"""Alarm levels at which a sum stays, so that it falls soon when the fault is gone."""
TARE_TIME, AT_REST = 0.5, 0.8
"""[s], [rad/s] Time constant of the tare, and motor speed up to which the motor stands."""
NO_TORQUE, NO_SPEED = 1.0, 0.3
"""[N m], [rad/s of the drum] Values that a sensor may show without any noise."""

Pair = tuple[float, float]
"""Sums of a residual and of its negative."""
NOTHING = (0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Plausibility:
    """Sums of the relations, for either sign, and what else is remembered.

    motor, gear, drum, sudden, gain, touching : sums of e_1, e_2, e_3, e_4, e_6, e_5
    noise, level : noise of the motor's balance, and alarm level of e_1 and e_4 for it [N m s]
    mean, envelope : mean torque of the motor, and the largest mean, fading [N m]
    steady : what a sudden fault shows against
    contact : time since which the gear pushes [s]
    acceleration : of the motor, smoothed [rad/s^2]
    tare, stands : mean of k Phi i + T_meas at standstill [N m], and time since it stands [s]
    still_torque, still_motor, still_drum : streaks of the three sensors
    """

    motor: Pair = NOTHING
    gear: Pair = NOTHING
    drum: Pair = NOTHING
    sudden: Pair = NOTHING
    gain: Pair = NOTHING
    touching: Pair = NOTHING
    noise: BalanceNoise = field(default_factory=BalanceNoise)
    level: float = inf
    mean: float = 0.0
    envelope: float = 0.0
    acceleration: float = 0.0
    steady: Steady = field(default_factory=Steady)
    contact: float = 0.0
    tare: float = 0.0
    stands: float = 0.0
    still_torque: Streak | None = None
    still_motor: Streak | None = None
    still_drum: Streak | None = None


def judge(
    p: Params,
    state: Plausibility,
    before: Measurement,
    now: Measurement,
    *,
    torque: float,
    duration: float,
) -> Plausibility:
    """Return the sums after one more window; `torque` : its mean without the sensor's errors."""
    first, last = motor_torque(p, before), motor_torque(p, now)
    gear_speed = now.motor_speed / p.gear_ratio
    middle = (before.motor_speed / p.gear_ratio + gear_speed) / 2.0
    mean = last + (state.mean - last) * exp(-duration / SMOOTHING_TIME)
    envelope = max(state.envelope * exp(-duration / ENVELOPE), abs(mean))
    rise = (now.motor_speed - before.motor_speed) / duration
    acceleration = rise + (state.acceleration - rise) * exp(-duration / RISE)
    e_1 = ((first + last) / 2.0 + torque) * duration - p.motor_inertia * rise * duration
    e_1 *= before.armature_current is not None and now.armature_current is not None
    k_1 = motor_tolerance(p, envelope, acceleration, duration / SCAN) * duration
    e_2 = (middle - (before.drum_speed + now.drum_speed) / 2.0) * duration
    k_2 = (p.speed + p.speed_share * max(abs(middle), abs(now.drum_speed))) * duration
    resisting = p.gear_ratio * torque + friction_torque(middle, p.regulator.friction)
    e_3 = p.drum_inertia * (now.drum_speed - before.drum_speed) + resisting * duration
    k_3 = p.truck_torque * duration
    sudden, missed = e_1 / duration - state.steady.residual, coarse(p, duration / SCAN)
    e_4 = sudden * duration
    steady = note(
        state.steady,
        # What polls have missed may be all of it, and gets into no mean.
        copysign(max(abs(e_1) / duration - missed, 0.0), e_1),
        last,
        duration,
        shown=torque,
        rise=rise,
        largest=p.torque + p.torque_share * envelope,
    )
    k_4 = (tolerance(steady, p.torque, share_of(p, steady.change)) + missed) * duration
    turned, allowed = product(steady, p.torque, p.torque_share)
    e_6, k_6 = turned * duration, (allowed + missed * abs(torque)) * duration
    contact = state.contact + duration if torque > p.contact else 0.0
    e_5, k_5 = (e_2, k_2) if contact > SETTLED_CONTACT else (0.0, inf)
    tare, stands = _tare(state, now, last + p.regulator.shaft_torque(now.shaft_torque), duration)
    noise = state.noise if stands else balance_noise.note(state.noise, sudden, duration)
    level = balance_noise.level(noise, DRIVING * p.torque, duration, p.rarity) + p.swing
    return Plausibility(
        motor=_sum(state.motor, e_1, k_1, level),
        gear=_sum(state.gear, e_2, k_2, p.gear_level),
        drum=_sum(state.drum, e_3, k_3, p.drum_level),
        sudden=_sum(state.sudden, e_4, k_4, level),
        gain=_sum(state.gain, e_6, k_6, p.gain * level),
        touching=_sum(state.touching, e_5, k_5, p.contact_level),
        noise=noise,
        level=level,
        mean=mean,
        envelope=envelope,
        acceleration=acceleration,
        steady=steady,
        contact=contact,
        tare=tare,
        stands=stands,
        # Inside the backlash the current moves the motor alone, and the torque is the friction.
        still_torque=None
        if Status.GAP in now.status and not p.noisy
        else follow(state.still_torque, now.shaft_torque, last, p.stuck_torque),
        still_motor=follow(state.still_motor, gear_speed, now.drum_speed, p.stuck_motor),
        still_drum=follow(state.still_drum, now.drum_speed, gear_speed, p.stuck_drum),
    )


def shares(p: Params, state: Plausibility) -> tuple[float, float, float]:
    """Largest sums of motor, gear and drum over their alarm levels [1]."""
    torque = max(*state.motor, *state.sudden, max(state.gain) / p.gain) / state.level
    play = max(max(state.gear) / p.gear_level, max(state.touching) / p.contact_level)
    return torque, play, max(state.drum) / p.drum_level


def reason(p: Params, state: Plausibility, *, running: bool) -> Reason | None:
    """Reason of the first relation that does not hold; None: all sensors are plausible."""
    motor = is_stuck(state.still_motor, NO_SPEED)
    drum = is_stuck(state.still_drum, NO_SPEED)
    shifted = state.stands > TARE_TIME and abs(state.tare) > p.tare
    balance, play, rest = shares(p, state)
    found = (
        (balance > 1.0, Reason.TORQUE_MODEL),
        (rest > 1.0, Reason.DRUM_MODEL),
        (play > 1.0, Reason.GEAR_MODEL),
        (is_stuck(state.still_torque, -1.0 if p.noisy else NO_TORQUE), Reason.TORQUE_STUCK),
        (motor or drum, Reason.SPEED_STUCK),
        (shifted and not running, Reason.TARE),
    )
    return next((reason for holds, reason in found if holds), None)


def motor_torque(p: Params, sample: Measurement) -> float:
    """Torque k Phi i of the motor [N m]; 0 without a current.

    k Phi = min(K_m, K_1 / (K_2 + |omega_m|))                               (thesis, eq 3.16-3.18)
    """
    weakened = p.flux_constant_1 / (p.flux_constant_2 + abs(sample.motor_speed))
    return min(p.flux_constant, weakened) * (sample.armature_current or 0.0)


def motor_tolerance(p: Params, envelope: float, acceleration: float, scans: float) -> float:
    """Tolerance of the motor's torque balance over a window of so many scans [N m]."""
    share = share_of(p, envelope)
    return p.torque + share * envelope + coarse(p, scans) + PULSES * abs(acceleration)


def share_of(p: Params, torque: float) -> float:
    """Share of a torque of the motor [N m] that drifted parameters may cause [1]."""
    return p.torque_share + REACTION * torque / p.full_torque


def coarse(p: Params, scans: float) -> float:
    """Tolerance of the motor's torque for a current that is known once in so many scans [N m]."""
    return COARSE_STEP * max(scans - 1.0, 0.0) + p.stairs * scans


def _sum(before: Pair, residual: float, tolerance: float, level: float) -> Pair:
    """CUSUM after one more window, for either sign, held at CUSUM_CEILING levels."""
    ceiling = CUSUM_CEILING * level
    return (
        min(max(before[0] + residual - tolerance, 0.0), ceiling),
        min(max(before[1] - residual - tolerance, 0.0), ceiling),
    )


def _tare(
    state: Plausibility, now: Measurement, torque: float, duration: float
) -> tuple[float, float]:
    """Mean torque at standstill [N m], and the time since the motor stands [s]."""
    if abs(now.motor_speed) > AT_REST:
        return 0.0, 0.0
    share = 1.0 - exp(-duration / TARE_TIME)
    return state.tare + share * (torque - state.tare), state.stands + duration
