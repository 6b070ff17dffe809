"""What a configuration lets expect of the bench, before any start: findings, worst first.

rho = (J_g + J_d) / (m r_d^2) (thesis, eq. 4.4) is the share of the bench's own inertia in the
emulated one: up to 1 the loop is stable for any delay, from 0.9 on it holds only if torque and
speed are seen over exactly the same window, by the same filter, without lead.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi

from gateway.config import Config
from gateway.friction import friction_torque
from gateway.road_load import road_load
from gateway.samples import NEEDS
from gateway.stability import DRIVE, Loop, smallest_mass, spectral_radius
from register_maps.register_map import RegisterMap

RESPONSE = 0.1
"""[s] in which a dynamometer has to settle within 10 % (40 CFR 1066.245)."""
DRIVE_LAG = 1.0 / DRIVE
"""[s] of the speed-controlled motor behind its reference."""
SCAN = 0.01
"""[s] over which the PLC's mean is taken (its fast task hands it on every scan)."""
RHO_REFUSED, RHO_WARNED = 0.9, 0.5
SEVERITIES = ("error", "warning", "info")
RPM = 2.0 * pi / 60.0


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing found: how bad, where (section and key), what, its value and what is allowed."""

    severity: str
    where: str
    what: str
    value: float | str
    allowed: str


def review(config: Config, register_map: RegisterMap) -> list[Finding]:
    """Everything there is to say, worst first."""
    found = [
        *_map(config, register_map),
        *_rho(config),
        *_stability(config),
        *_aliasing(config),
        *_timing(config),
        *_speeds(config),
        *_torque(config),
    ]
    return sorted(found, key=lambda finding: SEVERITIES.index(finding.severity))


def holds(findings: list[Finding]) -> bool:
    """Whether nothing is an error."""
    return all(finding.severity != "error" for finding in findings)


def rho_of(config: Config) -> float:
    """(J_g + J_d) / (m r_d^2)                                              (thesis, eq 4.4, 4.9)"""
    bench = config.bench
    inertia = bench.gear_inertia + bench.drum_inertia
    return inertia / (config.truck.total_mass * bench.drum_radius**2)


def loop_of(config: Config) -> Loop:
    """The loop as stability sees it, without the lead."""
    compensated = config.regulator.name != "thesis"
    return Loop(
        period=config.loop.period,
        dead_time=config.bench.dead_time,
        averaged=_same_window(config),
        torque_filter=config.bench.torque_filter,
        speed_filter=config.bench.speed_filter,
        trim=config.regulator.trim if compensated else 0.0,
    )


def _lead(config: Config) -> float:
    return 0.0 if config.regulator.name == "thesis" else config.regulator.lead


def _same_window(config: Config) -> bool:
    """Whether the torque spans exactly the window of the speed difference."""
    kind = config.regulator.torque
    return kind == "integrated" or (kind == "averaged" and config.loop.period <= SCAN)


def _filters_match(config: Config) -> bool:
    return config.bench.torque_filter == config.bench.speed_filter


def _map(config: Config, register_map: RegisterMap) -> Iterator[Finding]:
    needed = NEEDS[config.regulator.torque]
    if register_map.register(needed) is None:
        yield Finding(
            severity="error",
            where="regulator.torque",
            what=f"the register map {register_map.name} has no {needed}",
            value=config.regulator.torque,
            allowed=" or ".join(
                kind for kind, signal in NEEDS.items() if _has(register_map, signal)
            ),
        )
    if config.regulator.friction.temperature_coefficient and not any(
        _has(register_map, f"shell_temperature_{number}") for number in (1, 2)
    ):
        yield Finding(
            severity="warning",
            where="regulator.friction",
            what="friction depends on the shell's temperature, which the register map has not",
            value=config.regulator.friction.temperature_coefficient,
            allowed="0 without a shell temperature",
        )


def _has(register_map: RegisterMap, signal: str) -> bool:
    return register_map.register(signal) is not None


def _rho(config: Config) -> Iterator[Finding]:
    rho = rho_of(config)
    safe = _same_window(config) and _filters_match(config) and _lead(config) == 0.0
    severity = "info"
    if rho > RHO_WARNED:
        severity = "warning" if rho <= RHO_REFUSED or safe else "error"
    yield Finding(
        severity=severity,
        where="truck.mass_kg",
        what="loop gain rho: the bench's own inertia over the truck's",
        value=round(rho, 4),
        allowed="<= 0.5; to 0.9 with care; above only with torque and speed over the same window, "
        "matched filters and no lead",
    )
    if not _filters_match(config):
        yield Finding(
            severity="warning",
            where="bench.torque_filter_ms",
            what="torque and speed are filtered differently",
            value=config.bench.torque_filter * 1e3,
            allowed=f"bench.speed_filter_ms = {config.bench.speed_filter * 1e3:g}",
        )


def _stability(config: Config) -> Iterator[Finding]:
    """The sampled loop, computed; with lead its model is too strict, so that only warns."""
    loop, rho, mass = loop_of(config), rho_of(config), config.truck.total_mass
    least = smallest_mass(loop, rho * mass)
    yield Finding(
        severity="info" if mass >= least else "error",
        where="truck.mass_kg",
        what="smallest stable mass of the sampled loop in kg, without lead",
        value=round(least),
        allowed=f"<= {mass:g}",
    )
    radius = spectral_radius(replace(loop, lead=_lead(config)), rho)
    if _lead(config) > 0.0:
        yield Finding(
            severity="info" if radius <= 1.0 + 1e-7 else "warning",
            where="regulator.lead_s",
            what="growth of the sampled loop from poll to poll, with lead",
            value=round(radius, 6),
            allowed="<= 1",
        )


def _aliasing(config: Config) -> Iterator[Finding]:
    if _same_window(config):
        return
    phase = config.bench.dead_time % config.loop.period
    yield Finding(
        severity="warning",
        where="regulator.torque",
        what="torque of an instant or of one scan misses the pulses that the setpoint makes: the "
        f"emulated inertia is wrong by up to {100.0 * rho_of(config):.0f} %, depending on the dead "
        f"time over the period ({phase * 1e3:.0f} ms of {config.loop.period * 1e3:g} ms here)",
        value=config.regulator.torque,
        allowed="integrated",
    )


def _timing(config: Config) -> Iterator[Finding]:
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
    """From a change of torque to the motor's answer [s]: dead time, drive, a scan, half a poll."""
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


def _speeds(config: Config) -> Iterator[Finding]:
    """Whether the cycle fits into the limits of the setpoint."""
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


def _torque(config: Config) -> Iterator[Finding]:
    """Torque that the bench's motor must give against what its current allows.

    xi T_m = J theta_d'' + T_f - T_w' with T_w' = m r_d^2 theta_d'' + T_RL
    """
    truck, bench = config.truck, config.bench
    omega, road = truck.top_speed / bench.drum_radius, road_load(truck, bench)
    rolling = bench.drum_radius * road.force(truck.top_speed)
    friction = friction_torque(omega, config.regulator.friction)
    difference = bench.drum_radius * truck.total_mass * (1.0 - rho_of(config))
    at_constant_speed = friction - rolling
    accelerating = at_constant_speed - difference * truck.acceleration
    braking = at_constant_speed + difference * truck.braking
    flux = min(
        bench.flux_constant,
        bench.flux_constant_1 / (bench.flux_constant_2 + bench.gear_ratio * omega),
    )
    limit = bench.gear_ratio * flux * config.limits.current
    for name, torque in (("acceleration", accelerating), ("braking", braking)):
        yield Finding(
            severity="info" if abs(torque) <= limit else "warning",
            where=f"truck.{name}_m_s2",
            what=f"torque at the drum for the {name} at top speed, in N m, against the motor's",
            value=round(abs(torque)),
            allowed=f"<= {limit:.0f}",
        )
