"""Install the gateway as a service of systemd, or print its unit."""

from pathlib import Path

import click

EXAMPLE = """
\b
Examples:
  gateway install -c /etc/gateway/bench.toml --print
  sudo gateway install -c /etc/gateway/bench.toml
  gateway install -c /etc/gateway/bench.toml --board > gateway_board.json
"""


@click.command(epilog=EXAMPLE)
@click.option("-c", "--config", type=click.Path(path_type=Path), required=True, help="TOML file")
@click.option("--print", "printed", is_flag=True, help="print the unit, write nothing")
@click.option("--board", is_flag=True, help="print a board for Grafana, write nothing")
@click.option(
    "--to",
    "folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="another folder for the unit",
)
def command(config: Path, *, printed: bool, board: bool, folder: Path | None) -> int:
    """Write gateway.service, which runs this installation with a configuration.

    systemd starts the service, learns from it when the PLC answers, restarts it when its tick
    stands still, and keeps it from everything but the network and its recordings.
    """
    from gateway.config_file import load
    from gateway.runtime import service

    load(config)
    if printed or board:
        click.echo(service.board() if board else service.unit(config), nl=False)
        return 0
    click.echo(f"written: {service.install(config, folder or service.FOLDER)}")
    click.echo("next: systemctl daemon-reload && systemctl enable --now gateway")
    return 0
