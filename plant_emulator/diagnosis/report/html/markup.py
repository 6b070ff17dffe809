"""HTML and SVG elements whose text is always escaped.

Text that `tag` did not make is escaped, so that a name from a log file never becomes markup. The
result is also well-formed XML.
"""

from __future__ import annotations

from html import escape

from plant_emulator.diagnosis.wording import replace_unprintable

EMPTY = frozenset({"meta", "line", "rect", "path", "circle", "br", "col"})


class Markup(str):
    """Text that is already markup and is not escaped again."""

    __slots__ = ()


def tag(name: str, /, *content: str, **attributes: str | float) -> Markup:
    """An element with this content and these attributes.

    `class_` stands for the attribute class, and an underscore for a hyphen.
    """
    words = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{_attribute(value)}"'
        for key, value in attributes.items()
    )
    if name in EMPTY:
        return Markup(f"<{name}{words}/>")
    return Markup(f"<{name}{words}>{join(*content)}</{name}>")


def join(*content: str) -> Markup:
    """Markup and escaped text, one after the other."""
    return Markup("".join(c if isinstance(c, Markup) else _text(c) for c in content))


def _text(text: str) -> str:
    return escape(replace_unprintable(text), quote=False)


def _attribute(value: str | float) -> str:
    if isinstance(value, str):
        return escape(replace_unprintable(value))
    return f"{value:.2f}".rstrip("0").rstrip(".")
