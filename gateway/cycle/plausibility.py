"""Plausibility of the sensors from the model: parity relations in every window (pure).

Each relation holds for every driver and truck, and its residual is an impulse or an angle over the
window between two samples.

Motor. Torque of the current, torque of the shaft and acceleration of the motor balance:

    e_1 = integral (k Phi i + T_meas) dt - J_m (omega_m2 - omega_m1)        (thesis, eq 3.9, 3.26)

Gear. Motor and drum move apart by no more than the backlash, 2 alpha at the gear output:

    e_2 = integral (omega_m / xi - omega_d) dt                             (thesis, eq 3.31)

Drum. The rest of the torques on the drum is that of the truck, which has a limit:

    e_3 = (J_g + J_d) (omega_d2 - omega_d1) + integral (xi T_meas + T_f) dt     (thesis, eq 4.9)

A CUSUM adds up each residual beyond its tolerance, for either sign: S = max(0, S + e - k dt). The
tolerance k covers drifted parameters and neglected effects. The alarm level covers the noise; it
follows from the rate of false alarms that is allowed. Speeds enter e_1 and e_3 as differences, so
that the noise of a sum is that of its two ends.

A torque sensor that stands still to the last bit at some value, while the current moves, is stuck.
So is a speed sensor while the other speed moves, if the sensors are known to be noisy: inside the
backlash one side moves alone.
"""

from dataclasses import dataclass, replace
from math import exp, inf, log, sqrt
from statistics import NormalDist

from gateway.configuration.config import Config
from gateway.friction import Friction, friction_torque
from gateway.reasons import Reason
from register_maps.signals import Measurement, Status
from register_maps.timing import SCAN

SMOOTH, ENVELOPE, RISE = 0.05, 0.3, 0.1
"""[s] The tolerance follows the mean torque over the first time, because a wrong gain cancels in a
ripple. It remembers a large mean for the second time, because shafts ring and fluxes lag. The third
time smoothes the acceleration."""
PULSES = 0.08
"""[N m s^2/rad] Further tolerance of the motor's torque by its acceleration: a setpoint that rises
in steps drives pulses of current, of which a poll sees only one moment."""
REACTION = 0.25
"""Further share of the motor's torque at the full torque, where the current weakens the field."""
FULL_CURRENT = 72.0
"""[A] Largest armature current of the drive (thesis, eq 3.5)."""
COARSE, STAIRCASE = 4.0, 6.0
"""[N m] Further tolerance of the motor's torque a scan. The current is known at the polls only: the
first number counts for each scan between two polls, the second for each scan under a regulator
whose setpoint is a staircase, because the current then comes in pulses."""
TRANSIENT, BUMP = 0.25, 25.0
"""[N m s] Shares of two alarm levels for what a poll every 10 ms misses: those of e_1 and e_3."""
SWING, TOP_SPEED, FASTEST_DRUM = 60.0, 8.0, 5.0
"""[N m], [rad/s], [rad/s^2] Swings of motor torque, drum speed and drum acceleration. A filter in
front of the PLC shows them later by its time constant."""
GAP_SPREAD = 1.25
"""Widest backlash over the configured one."""
MOST = 1.02
"""Alarm levels at which a sum stays, so that it falls soon when the fault is gone."""
TARE_TIME, AT_REST = 0.5, 0.8
"""[s], [rad/s] Time constant of the tare, and motor speed up to which the motor stands."""
STUCK = 20
"""Samples in a row without a change. The noise of a sound sensor shows in every sample."""
SETTLED, LATE = 3, 3
"""Samples by which the partner may move after the sensor has settled, and before it follows. At
steady speed a sensor without noise shows one value for seconds."""
VISIBLE, VISIBLE_TORQUE = 2.5, 6.0
"""Deviations of the noise that the partner of a stuck sensor shows, a speed or the current."""
NO_TORQUE, NO_SPEED = 1.0, 0.3
"""[N m], [rad/s of the drum] Values that a sensor may show without any noise."""


@dataclass(frozen=True, kw_only=True)
class Params:
    """Parameters of the relations in SI, and what is allowed.

    flux_constant, flux_constant_1, flux_constant_2 : K_m, K_1, K_2 of the motor
    torque, torque_share : tolerance of e_1 a second [N m], and its share of the motor's torque [1]
    full_torque : of the motor, at full flux and the largest current [N m]
    stairs : further tolerance of e_1 for each scan of a window [N m]
    speed, speed_share : tolerance of e_2 a second [rad/s], and its share of the speed [1]
    truck_torque : tolerance of e_3 a second [N m at the drum]
    motor_level, gear_level, drum_level : alarm levels of the sums [N m s], [rad], [N m s]
    tare : mean of k Phi i + T_meas that a standing motor may show [N m]
    stuck_torque, stuck_motor, stuck_drum : how far motor torque, drum and motor may move while the
        sensor of torque, motor and drum stands still [N m], [rad/s of the drum]
    """

    motor_inertia: float
    drum_inertia: float
    gear_ratio: float
    flux_constant: float
    flux_constant_1: float
    flux_constant_2: float
    friction: Friction
    torque_offset: float
    torque: float
    torque_share: float
    full_torque: float
    stairs: float
    speed: float
    speed_share: float
    truck_torque: float
    motor_level: float
    gear_level: float
    drum_level: float
    tare: float
    stuck_torque: float
    stuck_motor: float
    stuck_drum: float

    @classmethod
    def of(cls, config: Config) -> "Params":
        """Parameters out of the configuration."""
        bench, own = config.bench, config.plausibility
        inertia, tail = bench.gear_inertia + bench.drum_inertia, _tail(config)
        flux, lag = bench.flux_constant, max(bench.torque_filter, bench.speed_filter)
        return cls(
            motor_inertia=bench.motor_inertia,
            drum_inertia=inertia,
            gear_ratio=bench.gear_ratio,
            flux_constant=flux,
            flux_constant_1=bench.flux_constant_1,
            flux_constant_2=bench.flux_constant_2,
            friction=config.regulator.friction,
            torque_offset=config.regulator.torque_offset,
            torque=own.torque,
            torque_share=own.torque_share,
            full_torque=flux * FULL_CURRENT,
            stairs=STAIRCASE if _is_staircase(config) else 0.0,
            speed=own.speed,
            speed_share=own.speed_share,
            truck_torque=own.truck_torque,
            motor_level=TRANSIENT
            + lag * SWING
            + tail * sqrt(2.0) * bench.motor_inertia * own.motor_speed_noise
            + _walk(config, own.torque, flux * own.current_noise, own.torque_noise),
            gear_level=2.0 * GAP_SPREAD * bench.backlash_half_gap
            + lag * TOP_SPEED
            + _walk(
                config, own.speed, own.drum_speed_noise, own.motor_speed_noise / bench.gear_ratio
            ),
            drum_level=BUMP
            + lag * inertia * FASTEST_DRUM
            + tail * sqrt(2.0) * inertia * own.drum_speed_noise,
            tare=own.tare,
            stuck_torque=VISIBLE_TORQUE * flux * own.current_noise,
            stuck_motor=VISIBLE * own.drum_speed_noise if own.noisy_speeds else inf,
            stuck_drum=VISIBLE * own.motor_speed_noise / bench.gear_ratio
            if own.noisy_speeds
            else inf,
        )


def _is_staircase(config: Config) -> bool:
    """Whether the regulator gives its setpoint no slope."""
    return config.regulator.name == "thesis" or config.regulator.torque == "instantaneous"


def _chance(config: Config) -> float:
    """Probability of a false alarm in one tick that the configuration allows, for each sum."""
    return config.plausibility.false_alarms * config.loop.period / 6.0


def _tail(config: Config) -> float:
    """Deviations that normal noise exceeds with this probability."""
    return -NormalDist().inv_cdf(_chance(config))


def _walk(config: Config, tolerance: float, *deviations: float) -> float:
    """Level that a sum of white noise passes with the allowed probability.

    P(S > h) = exp(-2 k h / (s^2 dt)) for increments of mean -k dt and variance (s dt)^2: the
    largest value of a random walk (E. S. Page, Biometrika 41 (1954) 100).
    """
    variance = sum(one * one for one in deviations) * config.loop.period
    return -log(_chance(config)) * variance / (2.0 * tolerance)


@dataclass(frozen=True, kw_only=True)
class Streak:
    """Readings of one sensor in a row that are equal, and the range of what belongs to it.

    late : count of the readings since its partner has visibly moved
    """

    value: float
    count: int
    lowest: float = inf
    highest: float = -inf
    late: int = 0


@dataclass(frozen=True, kw_only=True)
class Plausibility:
    """Sums of the three relations, for either sign, and what else is remembered.

    mean, envelope : mean torque of the motor, and the largest mean, fading [N m]
    acceleration : of the motor, smoothed [rad/s^2]
    tare, stands : mean of k Phi i + T_meas at standstill [N m], and time since it stands [s]
    torque, motor, drum : streaks of the three sensors
    """

    motor_up: float = 0.0
    motor_down: float = 0.0
    gear_up: float = 0.0
    gear_down: float = 0.0
    drum_up: float = 0.0
    drum_down: float = 0.0
    mean: float = 0.0
    envelope: float = 0.0
    acceleration: float = 0.0
    tare: float = 0.0
    stands: float = 0.0
    torque: Streak | None = None
    motor: Streak | None = None
    drum: Streak | None = None


def judge(
    p: Params,
    state: Plausibility,
    before: Measurement,
    now: Measurement,
    *,
    torque: float,
    duration: float,
) -> Plausibility:
    """Return the sums after one more window; `torque` is its mean of T_meas [N m]."""
    shown = torque - p.torque_offset
    first, last = motor_torque(p, before), motor_torque(p, now)
    gear_speed = now.motor_speed / p.gear_ratio
    middle = (before.motor_speed / p.gear_ratio + gear_speed) / 2.0
    mean = last + (state.mean - last) * exp(-duration / SMOOTH)
    envelope = max(state.envelope * exp(-duration / ENVELOPE), abs(mean))
    rise = (now.motor_speed - before.motor_speed) / duration
    acceleration = rise + (state.acceleration - rise) * exp(-duration / RISE)
    e_1 = ((first + last) / 2.0 + shown) * duration - p.motor_inertia * rise * duration
    e_1 *= before.armature_current is not None and now.armature_current is not None
    k_1 = _tolerance(p, envelope, acceleration, duration / SCAN) * duration
    e_2 = (middle - (before.drum_speed + now.drum_speed) / 2.0) * duration
    k_2 = (p.speed + p.speed_share * max(abs(middle), abs(now.drum_speed))) * duration
    resisting = p.gear_ratio * shown + friction_torque(middle, p.friction)
    e_3 = p.drum_inertia * (now.drum_speed - before.drum_speed) + resisting * duration
    k_3 = p.truck_torque * duration
    tare, stands = _tare(state, now, last + now.shaft_torque - p.torque_offset, duration)
    return Plausibility(
        motor_up=_sum(state.motor_up, e_1 - k_1, p.motor_level),
        motor_down=_sum(state.motor_down, -e_1 - k_1, p.motor_level),
        gear_up=_sum(state.gear_up, e_2 - k_2, p.gear_level),
        gear_down=_sum(state.gear_down, -e_2 - k_2, p.gear_level),
        drum_up=_sum(state.drum_up, e_3 - k_3, p.drum_level),
        drum_down=_sum(state.drum_down, -e_3 - k_3, p.drum_level),
        mean=mean,
        envelope=envelope,
        acceleration=acceleration,
        tare=tare,
        stands=stands,
        # Inside the backlash the current moves the motor alone, and the torque is the friction.
        torque=None
        if Status.GAP in now.status
        else _streak(state.torque, now.shaft_torque, last, p.stuck_torque),
        motor=_streak(state.motor, gear_speed, now.drum_speed, p.stuck_motor),
        drum=_streak(state.drum, now.drum_speed, gear_speed, p.stuck_drum),
    )


def reason(p: Params, state: Plausibility, *, running: bool) -> Reason | None:
    """Reason of the first relation that does not hold; None: all sensors are plausible."""
    motor = _is_stuck(state.motor, NO_SPEED)
    drum = _is_stuck(state.drum, NO_SPEED)
    shifted = state.stands > TARE_TIME and abs(state.tare) > p.tare
    found = (
        (max(state.motor_up, state.motor_down) > p.motor_level, Reason.TORQUE_MODEL),
        (max(state.drum_up, state.drum_down) > p.drum_level, Reason.DRUM_MODEL),
        (max(state.gear_up, state.gear_down) > p.gear_level, Reason.GEAR_MODEL),
        (_is_stuck(state.torque, NO_TORQUE), Reason.TORQUE_STUCK),
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


def _tolerance(p: Params, envelope: float, acceleration: float, scans: float) -> float:
    """Tolerance of the motor's torque balance over a window of so many scans [N m]."""
    share = p.torque_share + REACTION * envelope / p.full_torque
    coarse = COARSE * max(scans - 1.0, 0.0) + p.stairs * scans + PULSES * abs(acceleration)
    return p.torque + share * envelope + coarse


def _sum(before: float, growth: float, level: float) -> float:
    """CUSUM after one more window, held at MOST levels."""
    return min(max(before + growth, 0.0), MOST * level)


def _tare(
    state: Plausibility, now: Measurement, torque: float, duration: float
) -> tuple[float, float]:
    """Mean torque at standstill [N m], and the time since the motor stands [s]."""
    if abs(now.motor_speed) > AT_REST:
        return 0.0, 0.0
    share = 1.0 - exp(-duration / TARE_TIME)
    return state.tare + share * (torque - state.tare), state.stands + duration


def _streak(before: Streak | None, value: float, partner: float, visible: float) -> Streak:
    """Streak after one more sample; a sound sensor shows a move of `visible` in its partner.

    The first samples do not count, because the partner still moves when the sensor has settled.
    """
    if before is None or value != before.value:
        return Streak(value=value, count=1)
    if before.count < SETTLED:
        return replace(before, count=before.count + 1)
    lowest, highest = min(before.lowest, partner), max(before.highest, partner)
    late = before.late + (highest - lowest > visible)
    return replace(before, count=before.count + 1, lowest=lowest, highest=highest, late=late)


def _is_stuck(streak: Streak | None, nothing: float) -> bool:
    """Whether a sensor stands still at more than `nothing` long after its partner has moved."""
    if streak is None or streak.count < STUCK or abs(streak.value) <= nothing:
        return False
    return streak.late > LATE
