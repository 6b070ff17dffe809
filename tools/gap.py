"""Close the gap of a bench that hides an effect: drive, diagnose, unseal, regulate.

    tools/demo gap --seed 1

The seed draws the effect and its size. Their hash is printed first, so that nobody can change them.
"""

from __future__ import annotations

import sys
from pathlib import Path

import click
from rich.console import Console

from gateway.demo.gap import close_gap, told
from gateway.errors import GatewayError


@click.command()
@click.option("--seed", type=int, required=True, help="Draws the hidden effect and its size.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True)
def main(seed: int, out: Path) -> None:
    """Exit code 1: the hidden effect was not named, or a run did not come to its end."""
    console = Console(soft_wrap=True, highlight=False)
    try:
        result = close_gap(seed, out / f"seed_{seed}", console)
    except GatewayError as error:
        raise click.ClickException(str(error)) from error
    console.print(f"the hidden effect was {'named' if result.named else 'NOT named'}")
    console.print(
        f"gap closed: {_share(result.closed_of_nominal)} of the gap of the model in force, "
        f"{_share(result.closed)} of the gap that other parameters leave"
    )
    console.print(f"force on the truck in cruise before: {told(result.before)}")
    console.print(f"force on the truck in cruise after:  {told(result.after)}")
    console.print(f"{result.seconds:.0f} s; report and picture: {out}/seed_{seed}")
    sys.exit(0 if result.named else 1)


def _share(share: float | None) -> str:
    return "nothing told" if share is None else f"{100.0 * share:.1f} %"


if __name__ == "__main__":
    main()
