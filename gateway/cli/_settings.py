"""Options that several commands share."""

from collections.abc import Sequence

import click


def assignments(values: Sequence[str]) -> dict[str, str]:
    """`KEY=VALUE` texts as a dict."""
    pairs = [text.partition("=") for text in values]
    for key, equals, _ in pairs:
        if not equals or "." not in key:
            raise click.BadParameter(f"{key!r}: expected SECTION.KEY=VALUE", param_hint="--set")
    return {key: value for key, _, value in pairs}
