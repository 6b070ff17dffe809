"""The page of a certificate: HTML that prints on A4, loads nothing, and holds its document."""

import json
import re
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any, Final

TEMPLATE: Final = Path(__file__).with_suffix(".html")
DOCUMENT: Final = re.compile(
    r'<script type="application/json" id="certificate">(.*?)</script>', re.DOTALL
)
INDICES: Final = {
    "er_percent": "energy rating ER [%]",
    "dr_percent": "distance rating DR [%]",
    "eer_percent": "energy economy rating EER [%]",
    "ascr_percent": "absolute speed change rating ASCR [%]",
    "iwr_percent": "inertia work rating IWR [%]; for comparison -2 .. +4, second-hand",
    "rmsse_km_h": "speed error RMSSE [km/h]; for comparison 1.3, second-hand",
    "braking_road_joule": "work of braking on the road [J]",
    "braking_bench_joule": "work of braking on the bench [J]",
}
"""Indices of a document `j2951` in words; the limits were not read in the standard."""
RIGHT: Final = "+-0123456789"
"""First characters of a cell that stands at the right."""


def html(document: dict[str, Any]) -> str:
    """Page of a certificate; document : certificate/1."""
    holds = document["holds"]
    return Template(TEMPLATE.read_text("utf-8")).substitute(
        state="holds" if holds else "fails",
        verdict="Every value lies within its limit." if holds else _objections(document),
        about=_table((), _about(document)),
        runs="\n".join(_section(n, run) for n, run in enumerate(document["runs"], start=1)),
        # "<" would end the element of the script.
        document=json.dumps(document, indent=1).replace("<", "\\u003c"),
    )


def document_in(text: str) -> dict[str, Any] | None:
    """Document in the text of a page, or text of the document itself; None: there is none."""
    inside = DOCUMENT.search(text)
    try:
        found = json.loads(inside[1] if inside else text)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def is_written(text: str, document: dict[str, Any]) -> bool:
    """Whether the text is the document, or the page that this program makes of it."""
    return DOCUMENT.search(text) is None or text == html(document)


def _objections(document: dict[str, Any]) -> str:
    """Checks outside of their limits, and checks that no recording shows."""
    checks = [one for run in document["runs"] for one in run["checks"]]
    outside = dict.fromkeys(one["name"] for one in checks if not one["holds"])
    named = {"Outside": outside, "Not shown by these recordings": document["not_shown"]}
    return escape(
        " ".join(f"{what}: {', '.join(names)}." for what, names in named.items() if names)
    )


def _about(document: dict[str, Any]) -> Iterable[tuple[str, ...]]:
    known, parameters = document["map"], document["parameters"]
    yield "date", document["date"]
    yield "made by", document["program"]
    yield "register map", f"{known['name']}, sha256 {known['sha256']}"
    yield "parameter set", f"{parameters['set']}, sha256 {parameters['sha256']}"
    if parameters["effects"]:
        yield "effects of the set", ", ".join(parameters["effects"])
    for key, value in (parameters["origin"] or {}).items():
        yield f"origin of the set: {key}", _text(value)
    for key, value in document["bench"].items():
        yield key, _text(value)


def _section(number: int, run: dict[str, Any]) -> str:
    truck = run["truck"]
    rows = [("date", run["date"]), ("PLC", run["plc"]), ("gateway", run["gateway"])]
    rows += [("configuration", f"sha256 {run['config_sha256']}")]
    if run["budget"] is not None:
        rows.append(("truck", f"{truck['mass_kg']:g} kg + load {truck['load_kg']:g} kg"))
    rows += [(name, f"sha256 {digest}") for name, digest in run["files"].items()]
    parts = [f"<h2>{number}. Run: {escape(run['run'])}</h2>", _table((), rows)]
    if run["checks"]:
        head = ("check", "value of", "value", "limit", "", "source of the limit", "")
        parts.append(_table(head, map(_check, run["checks"])))
    if run["j2951"] is not None:
        indices = [(INDICES[key], _number(value)) for key, value in run["j2951"].items()]
        parts += ["<h3>Indices of SAE J2951, drum over demand</h3>", _table((), indices)]
    if run["budget"] is not None:
        columns = ("cause", "force [N]", "energy [%]", "speed [km/h]")
        part = "first {judged_seconds:.1f} of {duration_seconds:.1f} s".format_map(run["budget"])
        parts.append(f"<h3>Error budget against the road, {part}</h3>")
        parts.append(_table(columns, _budget(run["budget"])))
    return "<section>\n" + "\n".join(parts) + "\n</section>"


def _check(one: dict[str, Any]) -> tuple[str, ...]:
    mark = "" if one["holds"] else "OUTSIDE"
    limit = f"{one['limit']:g}"
    value = _number(one["value"])
    return one["name"], one["what"], value, limit, one["unit"], one["source"], mark


def _budget(budget: dict[str, Any]) -> Iterable[tuple[str, ...]]:
    rows = [(one["cause"], one) for one in budget["causes"]]
    rows += [("interaction", budget["interaction"]), ("drive", budget["left"])]
    for name, one in (*rows, ("whole", budget["whole"])):
        errors = (one["force_newton"], one["energy_percent"], one["speed_km_h"])
        yield name, *map(_number, errors)


def _number(value: float | None) -> str:
    """Value with four digits, at most three of them decimals."""
    if value is None:
        return "missing"
    whole = len(str(int(abs(value))))
    return f"{value:+.{max(4 - whole, 0)}f}"


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    cells = "".join(f"<th>{escape(one)}</th>" for one in head)
    first = f"<thead><tr>{cells}</tr></thead>"
    lines = ["<table>", *([first] if head else [])]
    lines += ["<tr>" + "".join(map(_cell, row)) + "</tr>" for row in rows]
    return "\n".join((*lines, "</table>"))


def _cell(text: str) -> str:
    kind = "outside" if text == "OUTSIDE" else "number" if text[:1] in tuple(RIGHT) else ""
    opened = f'<td class="{kind}">' if kind else "<td>"
    return f"{opened}{escape(text)}</td>"
