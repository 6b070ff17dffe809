"""Show a running gateway on the terminal, read only."""

import click

EXAMPLE = """
\b
Examples:
  gateway watch
  gateway watch --pid 4711
"""


@click.command(epilog=EXAMPLE)
@click.option("--pid", type=click.IntRange(min=1), help="process of the gateway, where several run")
def command(pid: int | None) -> int:
    """Show state, trends, times and the last changes of a gateway that runs on this computer.

    The page ends with Ctrl-C or with the gateway. It reads the status that the gateway keeps in
    memory; the gateway does not notice. Where the output is no terminal, it is written once.

    Exit code 1: no gateway runs here.
    """
    from rich.console import Console

    from gateway.monitoring import shared, terminal

    terminal.watch(shared.Observer(shared.find(pid)), Console(highlight=False))
    return 0
