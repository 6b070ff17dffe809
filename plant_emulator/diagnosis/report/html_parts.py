"""What the tables of the report are made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.report.markup import Markup, tag

if TYPE_CHECKING:
    from collections.abc import Iterable


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
    return scrolled(whole, caption)


def scrolled(content: Markup, label: str) -> Markup:
    """Content that can be scrolled where it is wider than the screen, also by keyboard."""
    return tag("div", content, class_="wide", tabindex="0", role="region", aria_label=label)


def right(head: str) -> Markup:
    """A column's head over numbers."""
    return tag("th", head, scope="col", class_="n")


def cell(value: str) -> Markup:
    """A number in a table."""
    return tag("td", value, class_="n")


def row_head(*content: str) -> Markup:
    """What a row is about."""
    return tag("th", *content, scope="row")


def bar(value: str, share: float | None) -> Markup:
    """A number over a bar of this share of the cell."""
    long = 100.0 * min(1.0, max(0.0, share or 0.0))
    return tag("td", value, class_="n bar", style=f"background-size: {long:.1f}% 1.3em")


def code(name: str) -> Markup:
    """A name as it is typed."""
    return tag("code", name)
