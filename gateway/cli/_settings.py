"""Options that several commands share."""

from collections.abc import Sequence

import click

from gateway.configuration.keys import CONTROL


def assignments(values: Sequence[str]) -> dict[str, str]:
    """`KEY=VALUE` texts as a dict."""
    pairs = [text.partition("=") for text in values]
    for key, equals, value in pairs:
        if not equals or "." not in key:
            raise click.BadParameter(f"{key!r}: expected SECTION.KEY=VALUE", param_hint="--set")
        if CONTROL.search(key + value):
            raise click.BadParameter(f"{value!r}: expected one line of text", param_hint="--set")
    return {key: value for key, _, value in pairs}
