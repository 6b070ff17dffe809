"""The command line `gateway`: every module of this folder is a command, by its file name.

Module `two_words.py` holds `command` and is called `two-words`; its docstring's first line is its
line in `--help`, which therefore imports no command. A leading underscore makes it no command.
"""

import ast
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import click


class CommandFolder(click.Group):
    """The commands of this folder, each imported only when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Names of all commands, sorted."""
        files = Path(__file__).parent.glob("[!_]*.py")
        return sorted(file.stem.replace("_", "-") for file in files)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command; None when there is no such file."""
        if cmd_name not in self.list_commands(ctx):
            return None
        module = import_module(f"{__name__}.{cmd_name.replace('-', '_')}")
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing any."""
        rows = [(name, summary(name)) for name in self.list_commands(ctx)]
        if rows:
            with formatter.section("Commands"):
                formatter.write_dl(rows)

    def main(self, *args: Any, **options: Any) -> Any:
        """Run and exit; an error meant for the operator becomes one line, never a traceback."""
        options["standalone_mode"] = False
        try:
            result = super().main(*args, **options)
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            sys.exit(2)
        except Exception as error:  # noqa: BLE001 - `verdict` raises again what is not for the operator
            code, line = verdict(error)
            click.echo(f"error: {' '.join(line.split())}", err=True)
            sys.exit(code)
        sys.exit(result if isinstance(result, int) else 0)


def summary(name: str) -> str:
    """First line of a command module's docstring, read without importing the module."""
    file = Path(__file__).with_name(f"{name.replace('-', '_')}.py")
    return (ast.get_docstring(ast.parse(file.read_text("utf-8"))) or "").partition("\n")[0]


def verdict(error: Exception) -> tuple[int, str]:
    """Exit code and text for an error that is meant for the operator; any other is raised again."""
    match error:
        case click.Abort():
            return (130 if isinstance(error.__cause__, KeyboardInterrupt) else 1), "stopped"
        case click.ClickException():
            return error.exit_code, error.format_message()
        case OSError(filename=str() as file):
            return 2, f"{file}: {error.strerror}"
        case OSError():
            return 1, str(error)
    code = getattr(error, "exit_code", None)
    if not isinstance(code, int):
        raise error
    return code, str(error)


@click.command(cls=CommandFolder)
@click.version_option(package_name="road-load-bench")
def main() -> None:
    """Drive a roller bench over Modbus TCP so that the truck on it feels the road."""
