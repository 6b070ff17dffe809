"""Findings on the loop of regulator, link and bench: gain, stability, aliasing.

rho = (J_g + J_d) / (m r_d^2) (thesis, eq. 4.4) is the inertia of the bench over the emulated
inertia. Up to 1 the loop is stable for any delay. From 0.9 on it is stable only without lead, and
with torque and speed over exactly the same window and behind the same filter.
"""

from collections.abc import Iterator
from dataclasses import replace

from gateway.configuration.config import Config
from gateway.review.finding import Finding
from gateway.review.stability import SpeedLoop, smallest_mass, spectral_radius
from register_maps.timing import SCAN

RHO_REFUSED, RHO_WARNED = 0.9, 0.5


def rho_of(config: Config) -> float:
    """Loop gain rho [1].

    rho = (J_g + J_d) / (m r_d^2)                                      (thesis, eq 4.4, 4.9)
    """
    bench = config.bench
    inertia = bench.gear_inertia + bench.drum_inertia
    return inertia / (config.truck.total_mass * bench.drum_radius**2)


def loop_of(config: Config) -> SpeedLoop:
    """Sampled loop of a configuration, without its lead."""
    compensated = config.regulator.name != "thesis"
    return SpeedLoop(
        period=config.loop.period,
        dead_time=config.bench.dead_time,
        averaged=_same_window(config),
        torque_filter=config.bench.torque_filter,
        speed_filter=config.bench.speed_filter,
        trim=config.regulator.trim if compensated else 0.0,
    )


def lead_of(config: Config) -> float:
    """Lead of the regulator [s]; the regulator of the thesis has none."""
    return 0.0 if config.regulator.name == "thesis" else config.regulator.lead


def _same_window(config: Config) -> bool:
    """Whether the torque belongs to exactly the window of the speed difference."""
    kind = config.regulator.torque
    return kind == "integrated" or (kind == "averaged" and config.loop.period <= SCAN)


def _filters_match(config: Config) -> bool:
    return config.bench.torque_filter == config.bench.speed_filter


def review_gain(config: Config) -> Iterator[Finding]:
    """Findings on rho, and on the conditions for a high rho."""
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


def review_stability(config: Config) -> Iterator[Finding]:
    """Findings on the stability of the sampled loop.

    With lead the model is too strict, so that it only warns.
    """
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


def review_aliasing(config: Config) -> Iterator[Finding]:
    """Findings on a torque that misses the response to the steps of the setpoint."""
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
