"""What is to be said of the limits beside each other, and beside what the bench can do at all."""

from collections.abc import Iterator

from gateway.configuration.config import Config
from gateway.review.finding import Finding
from gateway.review.limits import delay_of
from gateway.review.loop import lead_of
from register_maps.units import RPM

OVERSHOOT = 1.01
"""A drive under speed control overshoots a ramp by about 1 %."""
OFF, WIDE = 0.5, 0.25
"""Shares of the highest speed from which a deviation limits nothing, or little."""
BEYOND = 1.5
"""How far a slope may exceed what the motor can give its bench."""
LATE, TOO_LATE = 1.5, 3.0
"""Lead over the delay that it makes up for."""
LIGHTEST, HEAVIEST = 50.0, 2e4
"""[kg] of a drum as a mass at its rim; the thesis's is 752 kg."""
FOR_EVER = 1.0
"""[s] of missed deadlines after which nobody waits any more: the longest time of a watchdog."""


def limits(config: Config) -> Iterator[Finding]:
    """Whether each limit can be met before it is too late, and leaves a run."""
    most, loop = config.limits, config.loop
    overspeed, top = most.overspeed / RPM, most.speed_max / RPM
    yield from _graded(
        "limits.overspeed_rpm",
        "a run ends by overspeed within its own range of speeds",
        overspeed,
        warned=overspeed < OVERSHOOT * top,
        refused=overspeed <= top,
        allowed=f">= {OVERSHOOT * top:.0f}",
    )
    deviation = most.deviation / RPM
    yield from _graded(
        "limits.deviation_rpm",
        "setpoint may leave the measured speed far behind: the limit is as good as off",
        deviation,
        warned=deviation > WIDE * top,
        refused=deviation > OFF * top,
        allowed=f"<= {WIDE * top:.0f}, a quarter of limits.speed_max_rpm",
    )
    missed = loop.overruns * loop.period
    yield from _graded(
        "loop.overruns",
        "so many deadlines in ms outlast the PLC's watchdog",
        missed * 1e3,
        warned=missed > most.watchdog + 1e-9,
        refused=missed > FOR_EVER + 1e-9,
        allowed=f"<= {most.watchdog * 1e3:g}, and never over {FOR_EVER * 1e3:g}",
    )


def bench(config: Config) -> Iterator[Finding]:
    """Whether slopes, lead and inertia are those of a bench that there may be."""
    can = steepest(config) / RPM
    for key, rate, is_refused in (
        ("limits.rate_up_rpm_s", config.limits.rate_up / RPM, True),
        ("limits.rate_down_rpm_s", config.limits.rate_down / RPM, False),  # the safe direction
    ):
        yield from _graded(
            key,
            "slope that the motor cannot give its own bench at full current",
            rate,
            warned=rate > can,
            refused=is_refused and rate > BEYOND * can,
            allowed=f"<= {can:.0f}",
        )
    lead, delay = lead_of(config), delay_of(config)
    yield from _graded(
        "regulator.lead_s",
        "lead far over the delay that it makes up for",
        lead,
        warned=lead > LATE * delay,
        refused=lead > TOO_LATE * delay,
        allowed=f"<= {LATE * delay:.3f}",
    )
    rim = config.bench.drum_inertia / config.bench.drum_radius**2
    yield from _graded(
        "bench.drum_inertia_kg_m2",
        "the drum as a mass at its rim in kg",
        rim,
        warned=not LIGHTEST <= rim <= HEAVIEST,
        refused=False,
        allowed=f"{LIGHTEST:g} .. {HEAVIEST:g}",
    )


def steepest(config: Config) -> float:
    """Slope of the motor at full current below base speed, against its own drum [rad/s^2].

    xi (xi K_phi I_max) / (J_g + J_d): without the motor's inertia, so rather too much
    """
    known = config.bench
    at_drum = known.gear_ratio * known.flux_constant * config.limits.current
    return known.gear_ratio * at_drum / (known.gear_inertia + known.drum_inertia)


def _graded(
    where: str, what: str, value: float, *, warned: bool, refused: bool, allowed: str
) -> Iterator[Finding]:
    """A finding where there is one to make."""
    if warned or refused:
        yield Finding(
            severity="error" if refused else "warning",
            where=where,
            what=what,
            value=round(value, 3),
            allowed=allowed,
        )
