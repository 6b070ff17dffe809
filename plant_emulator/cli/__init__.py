"""The command line `plant-emulator`: every module of this folder is a command, by its file name."""

import click

from register_maps.command_line.folder import CommandFolder


@click.command(cls=CommandFolder, package=__name__)
@click.version_option(package_name="road-load-bench")
def main() -> None:
    """Emulate the roller bench and its PLC, and explain what its logs show."""
