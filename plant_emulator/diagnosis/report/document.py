"""The answer of a diagnosis as the JSON document `gap-diagnosis/1`: the only place of its keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from math import isfinite, nan
from typing import TYPE_CHECKING, Any

from plant_emulator.diagnosis.answer import (
    Answer,
    Cell,
    Curve,
    Draft,
    HeldOutGap,
    Location,
    Logs,
    ParameterDeviation,
    Quantity,
    RankedEffect,
    SearchStep,
    SensorNoise,
    Undetectable,
    Verdict,
)

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

SCHEMA = "gap-diagnosis/1"
# Attributes that cannot have the name of their key: `class` is a word of Python.
KEYS = {"classes": "class"}
# The one axis of the residual map that stands in the document.
PHASE = "phase"


def to_json(answer: Answer) -> dict[str, Any]:
    """Write an answer as plain mappings, lists, texts and numbers.

    A number that is not finite becomes null, because JSON has none (RFC 8259).
    """
    return {"schema": SCHEMA, **_document(answer)}


def from_json(document: Mapping[str, Any]) -> Answer:
    """Read an answer that `to_json` wrote; null in the place of a number becomes NaN."""
    return Answer(
        logs=Logs(**{key: tuple(names) for key, names in document["logs"].items()}),
        verdict=_verdict(document["verdict"]),
        location=_location(document["location"]),
        gap=_gap(document["gap"]),
        ranking=tuple(_ranked_effect(entry) for entry in document["ranking"]),
        undetectable=tuple(Undetectable(**entry) for entry in document["undetectable"]),
        trace=tuple(_search_step(entry) for entry in document.get("trace", ())),
        noise=tuple(_sensor_noise(entry) for entry in document.get("noise", ())),
        drafts=tuple(map(_draft, document["drafts"])) if "drafts" in document else None,
    )


def _document(record: DataclassInstance) -> dict[str, Any]:
    """A record as the document has it."""
    match record:
        case Cell():
            where = {"channel": record.channel, record.axis: record.bin}
            return {**where, "gap": _plain(record.gap), "noise": _plain(record.noise)}
        case Location():
            shares = [{"name": k, "share": _plain(share)} for k, share in record.shares.items()]
            return {
                "subsystem": record.subsystem,
                "channel": record.channel,
                "phase": record.phase,
                "subsystems": shares,
                "map": _plain(record.maps.get(PHASE, ())),
            }
    names = [field.name for field in fields(record)]
    if isinstance(record, Answer) and record.drafts is None:
        names.remove("drafts")
    return {KEYS.get(name, name): _plain(getattr(record, name)) for name in names}


def _plain(value: Any) -> Any:
    match value:
        case float():
            return value if isfinite(value) else None
        case tuple():
            return [_plain(one) for one in value]
        case Mapping():
            return {key: _plain(one) for key, one in value.items()}
        case bool() | int() | str() | None:
            return value
    return _document(value)


def _verdict(part: Mapping[str, Any]) -> Verdict:
    return Verdict(
        kind=part["kind"],
        effects=tuple(part["effects"]),
        classes=tuple(tuple(names) for names in part["class"]),
        parameters=tuple(
            ParameterDeviation(**_numbers(entry, "nominal", "estimated", "standard_error"))
            for entry in part["parameters"]
        ),
        confidence=part["confidence"],
        statement=part["statement"],
        next_experiment=part["next_experiment"],
        log_odds=part.get("log_odds"),
    )


def _location(part: Mapping[str, Any]) -> Location:
    return Location(
        subsystem=part["subsystem"],
        channel=part["channel"],
        phase=part["phase"],
        shares={entry["name"]: _number(entry["share"]) for entry in part["subsystems"]},
        cells=tuple(_cell(entry) for entry in part["map"]),
    )


def _cell(entry: Mapping[str, Any]) -> Cell:
    gap, noise = _number(entry["gap"]), _number(entry["noise"])
    return Cell(channel=entry["channel"], axis=PHASE, bin=entry[PHASE], gap=gap, noise=noise)


def _gap(part: Mapping[str, Any]) -> HeldOutGap:
    keys = ("nominal", "recalibrated", "explained", "noise_floor")
    by_channel = {key: {c: _number(x) for c, x in (part[key] or {}).items()} for key in keys}
    interval = part["closed_fraction_ci95"]
    return HeldOutGap(
        **by_channel,
        closed_fraction=part["closed_fraction"],
        closed_fraction_ci95=interval and (_number(interval[0]), _number(interval[1])),
    )


def _ranked_effect(entry: Mapping[str, Any]) -> RankedEffect:
    sizes = [Quantity(**_numbers(p, "value", "standard_error")) for p in entry["parameters"]]
    return RankedEffect(**{**_numbers(entry, "evidence"), "parameters": tuple(sizes)})


def _search_step(entry: Mapping[str, Any]) -> SearchStep:
    promised = {name: _number(gain) for name, gain in entry["promised"].items()}
    own = {"effects": tuple(entry["effects"]), "promised": promised}
    return SearchStep(**{**_numbers(entry, "gain", "mean_square"), **own})


def _sensor_noise(entry: Mapping[str, Any]) -> SensorNoise:
    return SensorNoise(**{**entry, "lines": tuple(entry["lines"])})


def _draft(entry: Mapping[str, Any]) -> Draft:
    intervals = {
        key: entry[key] and tuple(entry[key]) for key in ("held_out_gain_ci95", "bound_ci95")
    }
    drawn: dict[str, Any] = {
        key: tuple(map(_number, value)) if isinstance(value, list) else value
        for key, value in entry["curve"].items()
    }
    rivals = tuple(entry["rivals"])
    return Draft(**{**entry, **intervals, "rivals": rivals, "curve": Curve(**drawn)})


def _numbers(entry: Mapping[str, Any], *keys: str) -> dict[str, Any]:
    """An entry with NaN in the place of a null under these keys."""
    return {**entry, **{key: _number(entry[key]) for key in keys}}


def _number(value: float | None) -> float:
    return nan if value is None else value
