"""Findings on times, speeds and torques: does a run fit into the limits?"""

from collections.abc import Iterator

from gateway.configuration.config import Config
from gateway.friction.law import idle_torque
from gateway.physics.motor import flux
from gateway.physics.road_load import road_load
from gateway.review.finding import Finding
from gateway.review.loop import rho_of
from gateway.review.stability import DRIVE
from register_maps.timing import SCAN
from register_maps.units import RPM

RESPONSE = 0.1
"""[s] Time within which a dynamometer must settle to 10 % (40 CFR 1066.245)."""
DRIVE_LAG = 1.0 / DRIVE
"""[s] Lag of the speed-controlled motor behind its reference."""


def review_timing(config: Config) -> Iterator[Finding]:
    """Findings on polls, time-outs and watchdog: do they fit each other?"""
    period, stale = config.loop.period, config.loop.stale
    timeout, watchdog = config.plc.timeout, config.limits.watchdog
    pairs = (
        ("error", "loop.period_ms", "a single lost poll makes a sample stale", period, stale / 2),
        ("error", "plc.timeout_ms", "two time-outs outlast a sample", timeout, stale / 2),
        ("warning", "loop.stale_ms", "detection takes over 150 ms", stale + period, 0.15),
        ("error", "limits.watchdog_ms", "PLC ramps down between writes", 2 * period, watchdog),
        ("warning", "limits.watchdog_ms", "PLC ramps down before the gateway", stale, watchdog),
    )
    yield _delay(config)
    if period < SCAN - 1e-9:
        yield Finding(
            severity="warning",
            where="loop.period_ms",
            what="the PLC makes one sample a scan: faster polls read the same one again",
            value=round(period * 1e3, 3),
            allowed=f">= {SCAN * 1e3:g} ms",
        )
    for severity, where, what, value, most in pairs:
        if value > most + 1e-9:
            yield Finding(
                severity=severity,
                where=where,
                what=what,
                value=round(value * 1e3, 3),
                allowed=f"<= {most * 1e3:g} ms",
            )


def delay_of(config: Config) -> float:
    """Delay from a torque to the motor's response [s]: dead time, drive, a scan, half a poll."""
    return config.bench.dead_time + DRIVE_LAG + SCAN + config.loop.period / 2


def _delay(config: Config) -> Finding:
    delay = delay_of(config)
    return Finding(
        severity="info" if delay <= RESPONSE + 1e-9 else "warning",
        where="bench.dead_time_ms",
        what="delay from torque to motor (dead time, drive, scan, half a poll) in ms",
        value=round(delay * 1e3, 1),
        allowed=f"<= {RESPONSE * 1e3:g}, the response that 40 CFR 1066.245 asks of dynamometers",
    )


def review_speeds(config: Config) -> Iterator[Finding]:
    """Findings on the planned run: does it fit into the limits of the setpoint?"""
    truck, bench, most = config.truck, config.bench, config.limits
    to_motor = bench.gear_ratio / bench.drum_radius
    delay = bench.dead_time + DRIVE_LAG + config.loop.period
    speed, rise = truck.top_speed * to_motor, truck.acceleration * to_motor
    fall = truck.braking * to_motor
    needs = (
        ("limits.speed_max_rpm", "motor speed at top speed", speed, most.speed_max),
        ("limits.rate_up_rpm_s", "slope of the acceleration", rise, most.rate_up),
        ("limits.rate_down_rpm_s", "slope of the braking", fall, most.rate_down),
        ("limits.deviation_rpm", "lag of drive and link", max(rise, fall) * delay, most.deviation),
    )
    for where, what, needed, allowed in needs:
        yield Finding(
            severity="info" if needed <= allowed else "error",
            where=where,
            what=f"{what}, against the limit",
            value=round(needed / RPM, 1),
            allowed=f"<= {allowed / RPM:.0f}",
        )


def review_torque(config: Config) -> Iterator[Finding]:
    """Findings on the motor: does its current allow the torque of the planned run?

    xi T_m = J theta_d'' + T_f - T_w' with T_w' = m r_d^2 theta_d'' + T_RL
    """
    truck, bench = config.truck, config.bench
    omega, road = truck.top_speed / bench.drum_radius, road_load(truck, bench)
    rolling = bench.drum_radius * road.force(truck.top_speed)
    friction = idle_torque(omega, config.regulator.friction)
    difference = bench.drum_radius * truck.total_mass * (1.0 - rho_of(config))
    at_constant_speed = friction - rolling
    accelerating = at_constant_speed - difference * truck.acceleration
    braking = at_constant_speed + difference * truck.braking
    limit = bench.gear_ratio * flux(bench, bench.gear_ratio * omega) * config.limits.current
    for name, torque in (("acceleration", accelerating), ("braking", braking)):
        yield Finding(
            severity="info" if abs(torque) <= limit else "warning",
            where=f"truck.{name}_m_s2",
            what=f"torque at the drum for the {name} at top speed, in N m, against the motor's",
            value=round(abs(torque)),
            allowed=f"<= {limit:.0f}",
        )
