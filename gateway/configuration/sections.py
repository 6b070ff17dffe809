"""The sections of the configuration: frozen records in SI with the keys of the TOML file.

Each field declares its key: name in the file, default, factor to SI, range or choices.
"""

from dataclasses import dataclass
from typing import Any

from gateway.configuration.keys import declare
from gateway.configuration.memory import NOTHING, Memory
from gateway.friction.law import THESIS, Friction
from register_maps.units import KMH, RPM

MILLI = 1e-3
PERCENT = 1e-2


@dataclass(frozen=True, kw_only=True)
class PlcConfig:
    """Address of the PLC, its register map, and time-outs.

    timeout : of one request [s]
    settle : of the first request after connecting, for which some PLCs take longer [s]
    tls_authority, tls_certificate, tls_key : files of Modbus/TCP Security; None: a plain connection
    """

    host: str = declare("host", "127.0.0.1")
    port: int = declare("port", 5020, lower=1, upper=65535)
    unit: int = declare("unit", 1, lower=0, upper=255)
    map: str = declare("map", "bench_int16")
    timeout: float = declare("timeout_ms", 40.0, scale=MILLI, lower=1.0, upper=1000.0)
    settle: float = declare("settle_ms", 1000.0, scale=MILLI, lower=1.0, upper=60000.0)
    tls_authority: str | None = declare("tls_authority", None)
    tls_certificate: str | None = declare("tls_certificate", None)
    tls_key: str | None = declare("tls_key", None)


@dataclass(frozen=True, kw_only=True)
class LoopConfig:
    """The loop.

    period : from tick to tick [s]
    stale : age at which a sample is too old [s]
    overruns : deadlines in a row that may be missed
    realtime : ask the operating system for real time
    """

    period: float = declare("period_ms", 10.0, scale=MILLI, lower=1.0, upper=200.0)
    stale: float = declare("stale_ms", 100.0, scale=MILLI, lower=5.0, upper=1000.0)
    overruns: int = declare("overruns", 15, lower=1, upper=1000)
    realtime: bool = declare("realtime", True)


@dataclass(frozen=True, kw_only=True)
class BenchConfig:
    """The bench as the regulator knows it (thesis, Table 3.1).

    drum_inertia, gear_inertia [kg m^2]; drum_radius [m]; gear_ratio [1]
    dead_time : of the drive's reference [s]
    torque_filter, speed_filter : time constants of first-order filters in front of the PLC [s]
    flux_constant, flux_constant_1, flux_constant_2 : K_m, K_1, K_2 of the motor
    motor_inertia [kg m^2]; backlash_half_gap : at the gear output [rad]
    """

    drum_inertia: float = declare("drum_inertia_kg_m2", 312.69, lower=1.0, upper=1e5)
    gear_inertia: float = declare("gear_inertia_kg_m2", 0.02242, lower=0.0, upper=1e4)
    drum_radius: float = declare("drum_radius_m", 0.645, lower=0.05, upper=5.0)
    gear_ratio: float = declare("gear_ratio", 62.6, lower=1.0, upper=1000.0)
    dead_time: float = declare("dead_time_ms", 63.947, scale=MILLI, lower=0.0, upper=500.0)
    torque_filter: float = declare("torque_filter_ms", 0.0, scale=MILLI, lower=0.0, upper=1000.0)
    speed_filter: float = declare("speed_filter_ms", 0.0, scale=MILLI, lower=0.0, upper=1000.0)
    flux_constant: float = declare("flux_constant", 1.8506, lower=0.01, upper=100.0)
    flux_constant_1: float = declare("flux_constant_1", 366.83, lower=1.0, upper=1e5)
    flux_constant_2: float = declare("flux_constant_2", 8.0644, lower=0.0, upper=1e3)
    motor_inertia: float = declare("motor_inertia_kg_m2", 0.128, lower=1e-3, upper=1e3)
    backlash_half_gap: float = declare("backlash_half_gap_rad", 0.15073, lower=0.0, upper=1.0)


@dataclass(frozen=True, kw_only=True)
class TruckConfig:
    """The truck that the bench emulates.

    mass, load [kg]; wheel_radius [m]
    crr, crr_v : rolling resistance [1], and its part with the drum's speed [s] (thesis, eq 4.11)
    f0, f1, f2 : road load [N], [N s/m], [N s^2/m^2] instead of crr and crr_v; None: crr holds
    grade : rise over run [1]
    top_speed, acceleration, braking : of the planned run [m/s], [m/s^2]; only the review reads them
    """

    mass: float = declare("mass_kg", 3640.0, lower=50.0, upper=1e5)
    load: float = declare("load_kg", 0.0, lower=0.0, upper=1e5)
    wheel_radius: float = declare("wheel_radius_m", 0.1715, lower=0.02, upper=2.0)
    crr: float = declare("crr", 0.011721, lower=0.0, upper=0.2)
    crr_v: float = declare("crr_v", 9.3882e-6, lower=0.0, upper=0.1)
    f0: float | None = declare("f0_N", None, lower=0.0, upper=1e5)
    f1: float | None = declare("f1_N_per_m_s", None, lower=-1e4, upper=1e4)
    f2: float | None = declare("f2_N_per_m2_s2", None, lower=-1e3, upper=1e3)
    grade: float = declare("grade_percent", 0.0, scale=PERCENT, lower=-50.0, upper=50.0)
    top_speed: float = declare("top_speed_km_h", 14.0, scale=KMH, lower=0.1, upper=100.0)
    acceleration: float = declare("acceleration_m_s2", 0.65, lower=0.0, upper=10.0)
    braking: float = declare("braking_m_s2", 1.05, lower=0.0, upper=10.0)

    @property
    def total_mass(self) -> float:
        """Mass of truck and load [kg]."""
        return self.mass + self.load


@dataclass(frozen=True, kw_only=True)
class RegulatorConfig:
    """The regulator and its settings.

    torque : torque that the regulator uses: integral, mean of the last scan, or momentary value
    lead : time by which the demand leads by the emulated acceleration [s]
    trim : gain on virtual minus drum speed [1]; with 64 ms dead time and 10 ms scan, the shaft
        torque rings after a reversal from 0.8 on
    under_compensation : share of the friction that is not compensated
    under_compensation_slow : share at standstill; it falls to the other share at 0.5 rad/s of the
        drum
    torque_offset, torque_gain, torque_lag : of the torque sensor, which the regulator takes out:
        torque that it shows without load [N m], error of its gain [1], time constant [s]
    breakaway : torque over the road load at which a standing truck starts [N m at the drum]
    learned : what the learned regulator remembers of earlier runs
    """

    name: str = declare("name", "compensated")
    torque: str = declare(
        "torque", "integrated", choices=("integrated", "averaged", "instantaneous")
    )
    lead: float = declare("lead_s", 0.085, lower=0.0, upper=1.0)
    trim: float = declare("trim", 0.5, lower=0.0, upper=5.0)
    under_compensation: float = declare(
        "under_compensation_percent", 0.3, scale=PERCENT, lower=0.0, upper=20.0
    )
    under_compensation_slow: float = declare(
        "under_compensation_slow_percent", 2.0, scale=PERCENT, lower=0.0, upper=20.0
    )
    torque_offset: float = declare("torque_offset_Nm", 0.0, lower=-20.0, upper=20.0)
    torque_gain: float = declare("torque_gain_percent", 0.0, scale=PERCENT, lower=-50.0, upper=50.0)
    torque_lag: float = declare("torque_lag_ms", 0.0, scale=MILLI, lower=0.0, upper=1000.0)
    breakaway: float = declare("breakaway_Nm", 30.0, lower=0.0, upper=2000.0)
    friction: Friction = THESIS
    learned: Memory = NOTHING

    def shaft_torque(self, shown: Any) -> Any:
        """Torque of the shaft where the sensor steadily shows this one [N m], a number or array."""
        return (shown - self.torque_offset) / (1.0 + self.torque_gain)


@dataclass(frozen=True, kw_only=True)
class LimitsConfig:
    """Limits of the setpoint, and limits that the PLC gets. Speeds are those of the motor.

    speed_max, deviation : of the setpoint, and of setpoint minus measured speed [rad/s]
    rate_up, rate_down : slopes of the setpoint [rad/s^2]
    overspeed : measured speed at which the run ends [rad/s]
    current : armature current that the PLC may use [A]
    watchdog : time without a command after which the PLC ramps down by itself [s]
    """

    speed_max: float = declare("speed_max_rpm", 4830.0, scale=RPM, lower=1.0, upper=4830.0)
    rate_up: float = declare("rate_up_rpm_s", 3000.0, scale=RPM, lower=1.0, upper=30000.0)
    rate_down: float = declare("rate_down_rpm_s", 3000.0, scale=RPM, lower=1.0, upper=30000.0)
    deviation: float = declare("deviation_rpm", 400.0, scale=RPM, lower=1.0, upper=4830.0)
    overspeed: float = declare("overspeed_rpm", 5070.0, scale=RPM, lower=1.0, upper=6000.0)
    current: float = declare("current_limit_A", 72.0, lower=0.0, upper=72.0)
    watchdog: float = declare("watchdog_ms", 200.0, scale=MILLI, lower=50.0, upper=1000.0)


@dataclass(frozen=True, kw_only=True)
class PlausibilityConfig:
    """Allowed deviations of the sensors from the model of the bench (gateway.plausibility).

    false_alarms : rate that is allowed by noise [1/s, in the file an hour]
    torque, torque_share : tolerance of the motor's torque balance [N m], and its share of the
        motor's torque [1]
    speed, speed_share : tolerance of the difference of motor and drum [rad/s of the drum], and its
        share of the speed [1]
    truck_torque : the largest torque of a truck and its brake [N m at the drum]
    tare : mean torque that the sensor may show at standstill [N m]
    motor_speed_noise, drum_speed_noise [rad/s], torque_noise [N m], current_noise [A] : standard
        deviations of the sensors
    noisy_sensors : sensors of torque, current and speeds always show noise in motion, so that one
        without any is stuck
    """

    false_alarms: float = declare(
        "false_alarms_per_hour", 0.01, scale=1.0 / 3600.0, lower=1e-6, upper=100.0
    )
    torque: float = declare("torque_Nm", 1.0, lower=0.1, upper=100.0)
    torque_share: float = declare("torque_percent", 20.0, scale=PERCENT, lower=0.0, upper=100.0)
    speed: float = declare("speed_rad_s", 0.01, lower=0.001, upper=1.0)
    speed_share: float = declare("speed_percent", 2.5, scale=PERCENT, lower=0.0, upper=50.0)
    truck_torque: float = declare("truck_torque_Nm", 10000.0, lower=100.0, upper=1e6)
    tare: float = declare("tare_Nm", 1.5, lower=0.05, upper=100.0)
    motor_speed_noise: float = declare("motor_speed_noise_rad_s", 0.15, lower=0.0, upper=10.0)
    drum_speed_noise: float = declare("drum_speed_noise_rad_s", 0.01, lower=0.0, upper=1.0)
    torque_noise: float = declare("torque_noise_Nm", 0.25, lower=0.0, upper=10.0)
    current_noise: float = declare("current_noise_A", 0.25, lower=0.0, upper=10.0)
    noisy_sensors: bool = declare("noisy_sensors", False)


@dataclass(frozen=True, kw_only=True)
class RecordingConfig:
    """Folder of the recordings.

    rotate_size, rotate_time : at which a part of a recording ends [bytes, s]
    keep_age, keep_size : above which old recordings are removed [s, bytes]; None: never
    """

    dir: str = declare("dir", "recordings")
    rotate_size: float = declare("rotate_MB", 256.0, scale=1e6, lower=0.1, upper=2000.0)
    rotate_time: float = declare("rotate_h", 1.0, scale=3600.0, lower=0.001, upper=1000.0)
    keep_age: float | None = declare("keep_days", None, scale=86400.0, lower=0.01, upper=1e4)
    keep_size: float | None = declare("keep_GB", None, scale=1e9, lower=0.001, upper=1e6)


@dataclass(frozen=True, kw_only=True)
class MetricsConfig:
    """Address HOST:PORT at which metrics, health and a page are served; None: nowhere."""

    address: str | None = declare("address", None)


@dataclass(frozen=True, kw_only=True)
class VerificationConfig:
    """The verification of the emulated road: its trucks, and the limits of its checks.

    smallest, largest : masses of the emulated trucks [kg]
    losses, compensation, coast_down : errors of a force at the rim [N]
    torque, inertia, inertia_mean, acceleration : relative errors [1]
    response, settling : times to 90 %, and to 10 % for good, after a step in force [s]
    """

    smallest: float = declare("smallest_kg", 1500.0, lower=100.0, upper=1e5)
    largest: float = declare("largest_kg", 5240.0, lower=100.0, upper=1e5)
    losses: float = declare("losses_N", 9.0, lower=0.0, upper=1e4)
    torque: float = declare("torque_percent", 2.0, scale=PERCENT, lower=0.0, upper=100.0)
    inertia: float = declare("inertia_percent", 1.0, scale=PERCENT, lower=0.0, upper=100.0)
    inertia_mean: float = declare(
        "inertia_mean_percent", 0.2, scale=PERCENT, lower=0.0, upper=100.0
    )
    acceleration: float = declare(
        "acceleration_percent", 1.0, scale=PERCENT, lower=0.0, upper=100.0
    )
    compensation: float = declare("compensation_N", 5.0, lower=0.0, upper=1e4)
    coast_down: float = declare("coast_down_N", 9.8, lower=0.0, upper=1e4)
    response: float = declare("response_ms", 110.0, scale=MILLI, lower=0.0, upper=1e4)
    settling: float = declare("settling_ms", 1500.0, scale=MILLI, lower=0.0, upper=1e4)


SECTIONS: dict[str, type] = {
    "plc": PlcConfig,
    "loop": LoopConfig,
    "bench": BenchConfig,
    "truck": TruckConfig,
    "regulator": RegulatorConfig,
    "limits": LimitsConfig,
    "plausibility": PlausibilityConfig,
    "recording": RecordingConfig,
    "metrics": MetricsConfig,
    "verification": VerificationConfig,
}
