"""Findings on the limits: do they fit each other, and what the bench can do?"""

from collections.abc import Iterator

from gateway.configuration.config import Config
from gateway.review.finding import Finding
from gateway.review.limits import delay_of
from gateway.review.loop import lead_of
from register_maps.units import RPM

OVERSHOOT = 1.01
"""Overshoot of a drive under speed control after a ramp: about 1 %."""
OFF, WIDE = 0.5, 0.25
"""Shares of the highest speed above which a deviation limits nothing, or little."""
BEYOND = 1.5
"""Largest ratio of a slope to the slope that the motor can give its bench."""
LATE, TOO_LATE = 1.5, 3.0
"""Ratios of the lead to the delay that it compensates."""
LIGHTEST, HEAVIEST = 50.0, 2e4
"""[kg] Drum inertia as a mass at its rim; the drum of the thesis has 752 kg."""
FOR_EVER = 1.0
"""[s] Longest time of missed deadlines: the longest time of a watchdog."""


def review_limits(config: Config) -> Iterator[Finding]:
    """Findings on overspeed, deviation and missed deadlines."""
    most, loop = config.limits, config.loop
    overspeed, top = most.overspeed / RPM, most.speed_max / RPM
    yield from _grade(
        "limits.overspeed_rpm",
        "overspeed ends a run within its own range of speeds",
        overspeed,
        warned=overspeed < OVERSHOOT * top,
        refused=overspeed <= top,
        allowed=f">= {OVERSHOOT * top:.0f}",
    )
    deviation = most.deviation / RPM
    yield from _grade(
        "limits.deviation_rpm",
        "the setpoint may be far from the measured speed, so that this limit hardly acts",
        deviation,
        warned=deviation > WIDE * top,
        refused=deviation > OFF * top,
        allowed=f"<= {WIDE * top:.0f}, a quarter of limits.speed_max_rpm",
    )
    missed = loop.overruns * loop.period
    yield from _grade(
        "loop.overruns",
        "missed deadlines in ms that outlast the PLC's watchdog",
        missed * 1e3,
        warned=missed > most.watchdog + 1e-9,
        refused=missed > FOR_EVER + 1e-9,
        allowed=f"<= {most.watchdog * 1e3:g}, and never over {FOR_EVER * 1e3:g}",
    )


def review_bench(config: Config) -> Iterator[Finding]:
    """Findings on slopes, lead and inertia: are they those of a possible bench?"""
    can = steepest(config) / RPM
    for key, rate, is_refused in (
        ("limits.rate_up_rpm_s", config.limits.rate_up / RPM, True),
        ("limits.rate_down_rpm_s", config.limits.rate_down / RPM, False),  # downward is safe
    ):
        yield from _grade(
            key,
            "slope that the motor cannot give the bench even at full current",
            rate,
            warned=rate > can,
            refused=is_refused and rate > BEYOND * can,
            allowed=f"<= {can:.0f}",
        )
    lead, delay = lead_of(config), delay_of(config)
    yield from _grade(
        "regulator.lead_s",
        "lead far above the delay that it compensates",
        lead,
        warned=lead > LATE * delay,
        refused=lead > TOO_LATE * delay,
        allowed=f"<= {LATE * delay:.3f}",
    )
    rim = config.bench.drum_inertia / config.bench.drum_radius**2
    yield from _grade(
        "bench.drum_inertia_kg_m2",
        "the drum as a mass at its rim in kg",
        rim,
        warned=not LIGHTEST <= rim <= HEAVIEST,
        refused=False,
        allowed=f"{LIGHTEST:g} .. {HEAVIEST:g}",
    )


def steepest(config: Config) -> float:
    """Slope of the motor at full current below base speed against the drum alone [rad/s^2].

    xi (xi K_phi I_max) / (J_g + J_d), without the motor's inertia and therefore rather too large
    """
    known = config.bench
    at_drum = known.gear_ratio * known.flux_constant * config.limits.current
    return known.gear_ratio * at_drum / (known.gear_inertia + known.drum_inertia)


def _grade(
    where: str, what: str, value: float, *, warned: bool, refused: bool, allowed: str
) -> Iterator[Finding]:
    """Finding of a value that is warned of or refused; nothing otherwise."""
    if warned or refused:
        yield Finding(
            severity="error" if refused else "warning",
            where=where,
            what=what,
            value=round(value, 3),
            allowed=allowed,
        )
