"""HTML and SVG elements in which text can only be text.

Whatever is not made by `tag` is escaped, so a name out of a log file can never become markup. The
result is also well-formed XML: a strict parser reads it.
"""

from __future__ import annotations

from html import escape

from plant_emulator.diagnosis.wording import printable

EMPTY = frozenset({"meta", "line", "rect", "path", "circle", "br", "col"})


class Markup(str):
    """Text that is markup already."""

    __slots__ = ()


def tag(name: str, /, *content: str, **attributes: str | float) -> Markup:
    """An element; `class_` stands for class, an underscore in an attribute for a hyphen."""
    words = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{_attribute(value)}"'
        for key, value in attributes.items()
    )
    if name in EMPTY:
        return Markup(f"<{name}{words}/>")
    return Markup(f"<{name}{words}>{join(*content)}</{name}>")


def join(*content: str) -> Markup:
    """Markup as it is and text escaped, one after the other."""
    return Markup("".join(c if isinstance(c, Markup) else _text(c) for c in content))


def _text(text: str) -> str:
    return escape(printable(text), quote=False)


def _attribute(value: str | float) -> str:
    if isinstance(value, str):
        return escape(printable(value))
    return f"{value:.2f}".rstrip("0").rstrip(".")
