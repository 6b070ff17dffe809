"""The command line `gateway`: every module of this folder is a command, by its file name."""

import click

from register_maps.command_line.folder import CommandFolder


@click.command(cls=CommandFolder, package=__name__)
@click.version_option(package_name="road-load-bench")
def main() -> None:
    """Drive a roller bench over Modbus TCP so that the truck on it feels the road."""
