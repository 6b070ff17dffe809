"""Tables of the report and their cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.report.html.markup import Markup, tag

if TYPE_CHECKING:
    from collections.abc import Iterable

PLUS_MINUS = "\N{PLUS-MINUS SIGN}"
TIMES = "\N{MULTIPLICATION SIGN}"


def table(
    caption: str, heads: Iterable[str], rows: Iterable[Markup], look: str = "plain"
) -> Markup:
    """A table with its caption and the heads of its columns."""
    head = tag("tr", *(h if isinstance(h, Markup) else tag("th", h, scope="col") for h in heads))
    whole = tag(
        "table",
        tag("caption", caption),
        tag("thead", head),
        tag("tbody", *rows),
        class_=look,
    )
    return scroll_region(whole, caption)


def scroll_region(content: Markup, label: str) -> Markup:
    """Content that scrolls, also by keyboard, where it is wider than the screen."""
    return tag("div", content, class_="wide", tabindex="0", role="region", aria_label=label)


def right(head: str) -> Markup:
    """The head of a column of numbers."""
    return tag("th", head, scope="col", class_="n")


def cell(value: str) -> Markup:
    """A number in a table."""
    return tag("td", value, class_="n")


def row_head(*content: str) -> Markup:
    """The head of a row."""
    return tag("th", *content, scope="row")


def bar(value: str, share: float | None) -> Markup:
    """A number over a bar that fills this share of the cell."""
    long = 100.0 * min(1.0, max(0.0, share or 0.0))
    return tag("td", value, class_="n bar", style=f"background-size: {long:.1f}% 1.3em")


def code(name: str) -> Markup:
    """A name in the type of program text."""
    return tag("code", name)
