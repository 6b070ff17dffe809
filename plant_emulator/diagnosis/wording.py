"""Names and numbers of an answer in words, for the terminal and for the report."""

from __future__ import annotations

from math import floor, isfinite, log10
from typing import TYPE_CHECKING

from register_maps.signals import LOG_COLUMNS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import (
        Draft,
        HeldOutGap,
        Location,
        Logs,
        ParameterDeviation,
        Quantity,
        Verdict,
    )

UNKNOWN = "not known"
UNBROKEN = "\N{NO-BREAK SPACE}"
WITHOUT_UNIT = (None, "", "1")
UNITS = {column.signal: column.unit for column in LOG_COLUMNS.values()}
KINDS = {
    "effect": "Effect found",
    "parameter": "Parameter deviations only",
    "none": "No gap beyond the noise",
    "unknown": "Cause unknown",
}
# The whole that the subsystems' shares are parts of.
RESIDUAL, EXPLAINED = "of the residual", "of what effects explain"
EXPLAINED_GAP = "explained"
# Numbers from LARGE on, and below SMALL, are written with an exponent.
LARGE, SMALL = 1e6, 1e-4


def replace_unprintable(text: str) -> str:
    """The text without control characters, half characters and marks that turn its direction."""
    return "".join(c if c.isprintable() or c == "\n" else "\N{REPLACEMENT CHARACTER}" for c in text)


def in_words(name: str | None) -> str:
    """A name of the vocabulary as words."""
    return replace_unprintable(name).replace("_", " ") if name else UNKNOWN


def join_items(items: Sequence[str], most: int, between: str = ", ") -> str:
    """The first `most` items in a row, and the number of the others."""
    shown = [replace_unprintable(item) for item in items[:most]]
    rest = len(items) - len(shown)
    return between.join([*shown, f"and {rest} more"] if rest else shown)


def number(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits, or UNKNOWN."""
    if value is None or not isfinite(value):
        return UNKNOWN
    if value == 0.0:
        return "0"
    if not SMALL <= abs(value) < LARGE:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{max(0, digits - 1 - _power(value, digits))}f}"


def _power(value: float, digits: int) -> int:
    """The power of ten of a number that is rounded to so many digits."""
    return int(f"{value:.{digits - 1}e}".partition("e")[2])


def value_with_error(value: float | None, standard_error: float | None, sign: str = "+-") -> str:
    """A value and its standard error, both rounded to the second digit of the error."""
    if value is None or not isfinite(value):
        return UNKNOWN
    if standard_error is None or not isfinite(standard_error):
        return f"{number(value, 4)} {sign} {UNKNOWN}"
    if standard_error <= 0.0:
        return f"{number(value, 4)} {sign} 0"
    larger = max(abs(value), standard_error)
    power = 0 if SMALL <= larger < LARGE else floor(log10(larger))
    value, standard_error = value / 10.0**power, standard_error / 10.0**power
    decimals = max(0, 1 - _power(standard_error, 2))
    text = f"{value:.{decimals}f} {sign} {standard_error:.{decimals}f}"
    return text if power == 0 else f"({text})e{power}"


def percent(share: float | None) -> str:
    """A share of 1 in percent; with one decimal where it is nearly 0 or nearly 1."""
    if share is None or not isfinite(share):
        return UNKNOWN
    decimals = 1 if 0.0005 <= abs(share) < 0.0095 or 0.995 <= share < 0.9995 else 0
    return f"{round(100.0 * share, decimals) + 0.0:.{decimals}f} %"  # + 0.0: no minus zero


def size(quantity: Quantity, sign: str = "+-") -> str:
    """A value with its standard error and unit."""
    text = value_with_error(quantity.value, quantity.standard_error, sign)
    unit = quantity.unit
    return text if unit in WITHOUT_UNIT else f"{text} {replace_unprintable(unit)}"


def quantity(value: float | None, unit: str | None, digits: int = 3) -> str:
    """A number and its unit."""
    text = number(value, digits)
    return text if text == UNKNOWN or unit in WITHOUT_UNIT else f"{text} {unit}"


def own_name(parameter: str, effect: str) -> str:
    """A parameter's name without the effect's in front of it."""
    return replace_unprintable(parameter.removeprefix(f"{effect}_"))


def gap_rows(gap: HeldOutGap) -> dict[str, Mapping[str, float]]:
    """The gap by channel of every model, and the noise floor, each by its name in words.

    A row without channels is left out.
    """
    rows = {
        "nominal": gap.nominal,
        "recalibrated": gap.recalibrated,
        EXPLAINED_GAP: gap.explained,
        "noise floor": gap.noise_floor,
    }
    return {name: row for name, row in rows.items() if row}


def times_noise(gap: Mapping[str, float], noise_floor: Mapping[str, float]) -> float | None:
    """Gap of all channels together over the noise [1]: sqrt(mean((gap / noise_floor)^2))."""
    rows = [(g, noise_floor.get(c)) for c, g in gap.items()]
    shares = [g / floor_ for g, floor_ in rows if isfinite(g) and floor_]
    return (sum(s * s for s in shares) / len(shares)) ** 0.5 if shares else None


def logs_used(logs: Logs) -> str:
    """Numbers of fitted and of held-out logs, in words."""
    fitted, held_out = logs.estimation, logs.held_out
    if len(fitted) == 1 and fitted == held_out:
        return "1 log, its last part held out"
    if len(fitted) > 1 and set(fitted) == set(held_out):
        return f"{len(fitted)} logs, each held out in turn"
    counts = [(len(fitted), "fitted"), (len(held_out), "held out")]
    return ", ".join(f"{n} log{'' if n == 1 else 's'} {words}" for n, words in counts)


def closed_share(gap: HeldOutGap) -> str | None:
    """The closed fraction with its interval; None where the answer has no closed fraction."""
    if gap.closed_fraction is None:
        return None
    text, interval = percent(gap.closed_fraction), gap.closed_fraction_ci95
    if interval is None or not all(map(isfinite, interval)):
        return text
    return f"{text} (95 % interval {percent(interval[0])} to {percent(interval[1])})"


def describe_location(location: Location, units: Mapping[str, str]) -> str | None:
    """The location of the gap in one line; None where there is none."""
    if location.subsystem is None:
        return None
    parts = [in_words(location.subsystem)]
    if location.subsystem in location.shares:
        parts[0] += f" ({percent(location.shares[location.subsystem])} {share_of(location)})"
    channel, phase = location.channel, location.phase
    if channel is None:
        return parts[0]
    parts.append(in_words(channel) + (f" in {in_words(phase)}" if phase else ""))
    for cell in location.cells:
        if (cell.channel, cell.axis, cell.bin) == (channel, "phase", phase):
            unit = units.get(channel)
            parts[1] += f": {quantity(cell.gap, unit)}, noise {quantity(cell.noise, unit, 2)}"
    return ", ".join(parts)


def share_of(location: Location) -> str:
    """The whole that the subsystems' shares are parts of.

    For a machine without separable blocks it is what the effects explain, else the residual.
    """
    return RESIDUAL if location.cells else EXPLAINED


def describe_deviation(parameter: ParameterDeviation, sign: str = "+-") -> str:
    """A parameter deviation: nominal value, estimated value, standard error and unit."""
    estimated = size(parameter.quantity, sign)
    return f"{replace_unprintable(parameter.name)} {number(parameter.nominal, 4)} -> {estimated}"


def indistinguishable(verdict: Verdict) -> dict[str, tuple[str, ...]]:
    """The effects that these logs cannot distinguish from an accepted effect, by its name."""
    return {group[0]: group[1:] for group in verdict.classes if group}


def describe_draft_gain(draft: Draft) -> str:
    """Share of the held-out gap that a draft closes, in words."""
    if draft.held_out_gain is None or draft.held_out_gain_ci95 is None:
        return "no held-out run can be predicted"
    low, high = map(percent, draft.held_out_gain_ci95)
    told = f"closes {percent(draft.held_out_gain)} ({low} to {high}) of the held-out gap"
    if draft.bound is None:
        return told
    return f"{told}; at most {percent(draft.bound)}"
