"""Tolerances and alarm levels of the parity relations, from the configuration (pure).

A level covers the noise of the sensors and what a poll misses. The noise part follows from the rate
of false alarms that is allowed.
"""

from dataclasses import dataclass
from math import inf, log, sqrt
from statistics import NormalDist

from gateway.configuration.config import Config
from gateway.configuration.sections import RegulatorConfig
from gateway.plausibility.balance_noise import walk
from gateway.plausibility.sudden import DRIVING, PRODUCT_LEVEL, PRODUCT_SHARE

FULL_CURRENT = 72.0
"""[A] Largest armature current of the drive (thesis, eq 3.5)."""
SUMS = 12.0
"""Sums that may come to an alarm: six relations, each for either sign."""
STAIRCASE = 6.0
"""[N m] Further tolerance of the motor's torque a scan under a regulator whose setpoint is a
staircase, because the current then comes in pulses."""
BUMP = 25.0
"""[N m s] Share of the alarm level of e_3 for what a poll every 10 ms misses."""
SWING, TOP_SPEED, FASTEST_DRUM = 60.0, 8.0, 5.0
"""[N m], [rad/s], [rad/s^2] Swings of motor torque, drum speed and drum acceleration. A filter in
front of the PLC shows them later by its time constant."""
GAP_SPREAD = 1.25
"""Widest backlash over the configured one."""
VISIBLE, VISIBLE_TORQUE = 2.5, 6.0
"""Deviations of the noise by which the partner of a stuck sensor moves: in noise alone, and for
sure by more than noise."""
PUSH, BOUNCE = 1.0, 0.1
"""[N m] Torque above that of a shifted tare with which the gear is known to push the motor, and
[rad] what the flanks may still move then: shafts wind, and a light touch bounces."""


@dataclass(frozen=True, kw_only=True)
class Params:
    """Parameters of the relations in SI, and what is allowed.

    flux_constant, flux_constant_1, flux_constant_2 : K_m, K_1, K_2 of the motor
    regulator : its friction, and the known errors of the torque sensor
    torque, torque_share : tolerance of e_1 a second [N m], and its share of the motor's torque [1]
    full_torque : of the motor, at full flux and the largest current [N m]
    stairs : further tolerance of e_1 for each scan of a window [N m]
    speed, speed_share : tolerance of e_2 a second [rad/s], and its share of the speed [1]
    truck_torque : tolerance of e_3 a second [N m at the drum]
    rarity : an alarm of a sum is as rare as exp(-rarity) in one tick
    swing : share of the alarm level of e_1 for a filter in front of the PLC [N m s]
    gain : alarm level of e_6 over that of e_1: noise and tolerance have the torque as factor [N m]
    gear_level, drum_level : alarm levels of e_2 [rad] and e_3 [N m s]
    contact : shaft torque from which on the flanks of the gear are in contact [N m]
    contact_level : alarm level of e_2 while they are [rad]
    noisy : the sensors always show noise
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
    regulator: RegulatorConfig
    torque: float
    torque_share: float
    full_torque: float
    stairs: float
    speed: float
    speed_share: float
    truck_torque: float
    rarity: float
    swing: float
    gain: float
    gear_level: float
    drum_level: float
    contact: float
    contact_level: float
    noisy: bool
    tare: float
    stuck_torque: float
    stuck_motor: float
    stuck_drum: float

    @classmethod
    def of(cls, config: Config) -> "Params":
        """Parameters out of the configuration."""
        bench, own = config.bench, config.plausibility
        inertia, rarity = bench.gear_inertia + bench.drum_inertia, -log(_chance(config))
        flux, lag = bench.flux_constant, max(bench.torque_filter, bench.speed_filter)
        motor_noise, noisy = own.motor_speed_noise / bench.gear_ratio, own.noisy_sensors
        noise = own.drum_speed_noise**2 + motor_noise**2
        drift = walk(noise, own.speed, config.loop.period, rarity) + lag * TOP_SPEED
        return cls(
            motor_inertia=bench.motor_inertia,
            drum_inertia=inertia,
            gear_ratio=bench.gear_ratio,
            flux_constant=flux,
            flux_constant_1=bench.flux_constant_1,
            flux_constant_2=bench.flux_constant_2,
            regulator=config.regulator,
            torque=own.torque,
            torque_share=own.torque_share,
            full_torque=flux * FULL_CURRENT,
            stairs=STAIRCASE if _is_staircase(config) else 0.0,
            speed=own.speed,
            speed_share=own.speed_share,
            truck_torque=own.truck_torque,
            rarity=rarity,
            swing=lag * SWING,
            gain=PRODUCT_LEVEL * DRIVING * own.torque / (PRODUCT_SHARE * own.torque_share)
            if own.torque_share
            else inf,
            gear_level=2.0 * GAP_SPREAD * bench.backlash_half_gap + drift,
            drum_level=BUMP
            + lag * inertia * FASTEST_DRUM
            + _tail(config) * sqrt(2.0) * inertia * own.drum_speed_noise,
            contact=own.tare + PUSH,
            contact_level=BOUNCE + drift,
            noisy=noisy,
            tare=own.tare,
            stuck_torque=(VISIBLE if noisy else VISIBLE_TORQUE) * flux * own.current_noise,
            stuck_motor=VISIBLE * own.drum_speed_noise if noisy else inf,
            stuck_drum=VISIBLE * motor_noise if noisy else inf,
        )


def _is_staircase(config: Config) -> bool:
    """Whether the regulator gives its setpoint no slope."""
    return config.regulator.name == "thesis" or config.regulator.torque == "instantaneous"


def _chance(config: Config) -> float:
    """Probability of a false alarm in one tick that the configuration allows, for each sum."""
    return config.plausibility.false_alarms * config.loop.period / SUMS


def _tail(config: Config) -> float:
    """Deviations that normal noise exceeds with this probability."""
    return -NormalDist().inv_cdf(_chance(config))
