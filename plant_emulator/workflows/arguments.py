"""Checks of the arguments of the library: what is wrong, and what would be right, in one line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

from plant_emulator.errors import InputError, LogError
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.signals.log import Log

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

Item = TypeVar("Item")


def list_sources(sources: Item | Sequence[Item]) -> list[Item]:
    """List the sources; a single path or log counts as a list of one."""
    if isinstance(sources, str | Path | Log | AxisLog):
        return [cast("Item", sources)]
    return list(cast("Sequence[Item]", sources))


def list_logs(sources: Item | Sequence[Item]) -> list[Item]:
    """List the sources of an analysis. Raises InputError if there is none."""
    found = list_sources(sources)
    if not found:
        raise InputError("no log is given; at least one is needed")
    return found


def list_names(names: str | Sequence[str]) -> list[str]:
    """List the names; a single text counts as a list of one."""
    return [names] if isinstance(names, str) else list(names)


def check_choice(name: str, value: object, allowed: Collection[str | None]) -> None:
    """Raise InputError if the argument `name` has a value that is not allowed."""
    if value not in allowed:
        expected = " or ".join(repr(one) for one in allowed)
        raise InputError(f"{name}={value!r}; {expected} is expected")


def check_reference(reference: object) -> None:
    """Raise InputError if `reference` is no form of the speed reference between samples."""
    check_choice("reference", reference, (None, "linear", "staircase"))


def check_start(start: object) -> None:
    """Raise InputError if `start` is no choice of the start in the backlash gap."""
    check_choice("start", start, ("fit", "middle"))


def check_count(name: str, value: object, least: int) -> None:
    """Raise InputError if the argument `name` is no whole number of at least `least`."""
    if not isinstance(value, int) or value < least:
        raise InputError(f"{name}={value!r}; a whole number of at least {least} is expected")


def check_signals(log: Log, needed: Sequence[str]) -> None:
    """Raise LogError if a log lacks one of these signals; a log file has been checked before."""
    if missing := [name for name in needed if name not in log]:
        known = ", ".join(log.signals)
        raise LogError(f"{log.source}: no {', '.join(missing)}, which is needed; it has {known}")
