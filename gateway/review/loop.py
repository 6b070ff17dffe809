"""What is to be said of the loop of regulator, link and bench: gain, stability, aliasing.

rho = (J_g + J_d) / (m r_d^2) (thesis, eq. 4.4) is the share of the bench's own inertia in the
emulated one: up to 1 the loop is stable for any delay, from 0.9 on it holds only if torque and
speed are seen over exactly the same window, by the same filter, without lead.
"""

from collections.abc import Iterator
from dataclasses import replace

from gateway.configuration.config import Config
from gateway.review.finding import Finding
from gateway.review.stability import Loop, smallest_mass, spectral_radius
from register_maps.timing import SCAN

RHO_REFUSED, RHO_WARNED = 0.9, 0.5


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


def lead_of(config: Config) -> float:
    """Lead that the regulator takes [s]; the thesis's takes none."""
    return 0.0 if config.regulator.name == "thesis" else config.regulator.lead


def _same_window(config: Config) -> bool:
    """Whether the torque spans exactly the window of the speed difference."""
    kind = config.regulator.torque
    return kind == "integrated" or (kind == "averaged" and config.loop.period <= SCAN)


def _filters_match(config: Config) -> bool:
    return config.bench.torque_filter == config.bench.speed_filter


def gain(config: Config) -> Iterator[Finding]:
    """rho, and whether what a high one takes is there."""
    rho = rho_of(config)
    safe = _same_window(config) and _filters_match(config) and lead_of(config) == 0.0
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


def stability(config: Config) -> Iterator[Finding]:
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
    radius = spectral_radius(replace(loop, lead=lead_of(config)), rho)
    if lead_of(config) > 0.0:
        yield Finding(
            severity="info" if radius <= 1.0 + 1e-7 else "warning",
            where="regulator.lead_s",
            what="growth of the sampled loop from poll to poll, with lead",
            value=round(radius, 6),
            allowed="<= 1",
        )


def aliasing(config: Config) -> Iterator[Finding]:
    """Whether the torque misses what the steps of the setpoint do."""
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
