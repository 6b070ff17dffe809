"""What several commands share: values of `--set`, and the output of a JSON answer."""

import json
from collections.abc import Sequence
from typing import Any

import click

from gateway.configuration.keys import CONTROL


def assignments(values: Sequence[str]) -> dict[str, str]:
    """Key and value of each text `SECTION.KEY=VALUE`."""
    pairs = [text.partition("=") for text in values]
    for key, equals, value in pairs:
        if not equals or "." not in key:
            raise click.BadParameter(f"{key!r}: expected SECTION.KEY=VALUE", param_hint="--set")
        if CONTROL.search(key + value):
            raise click.BadParameter(f"{value!r}: expected one line of text", param_hint="--set")
    return {key: value for key, _, value in pairs}


def write_json(target: str, answer: dict[str, Any], indent: int | None = None) -> None:
    """Write an answer to a file, or to standard output for `-`."""
    with click.open_file(target, "w", encoding="utf-8") as file:
        file.write(json.dumps(answer, indent=indent) + "\n")
