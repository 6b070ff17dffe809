"""The command line `plant-emulator`: every module of this folder is a command.

Module `two_words.py` defines `command`, which the user calls `two-words`. The first line of the
module's docstring is its line in `--help`, so `--help` imports no command. A module whose name
begins with an underscore is not a command.
"""

import ast
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import click


class CommandFolder(click.Group):
    """The commands of this folder. Each one is imported only when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Names of all commands, sorted."""
        files = Path(__file__).parent.glob("[!_]*.py")
        return sorted(file.stem.replace("_", "-") for file in files)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command; return None if no such file exists."""
        if cmd_name not in self.list_commands(ctx):
            return None
        module = import_module(f"{__name__}.{cmd_name.replace('-', '_')}")
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without an import of any."""
        rows = [(name, summary(name)) for name in self.list_commands(ctx)]
        if rows:
            with formatter.section("Commands"):
                formatter.write_dl(rows)

    def main(self, *args: Any, **options: Any) -> Any:
        """Run and exit. An error meant for the operator becomes one line instead of a traceback."""
        options["standalone_mode"] = False
        try:
            result = super().main(*args, **options)
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            sys.exit(2)
        except Exception as error:  # noqa: BLE001 - `refusal` raises any other error again
            code, line = refusal(error)
            click.echo(f"error: {' '.join(line.split())}", err=True)
            sys.exit(code)
        sys.exit(result if isinstance(result, int) else 0)


def summary(name: str) -> str:
    """First line of a command module's docstring, read without an import of the module."""
    file = Path(__file__).with_name(f"{name.replace('-', '_')}.py")
    return (ast.get_docstring(ast.parse(file.read_text("utf-8"))) or "").partition("\n")[0]


def refusal(error: Exception) -> tuple[int, str]:
    """Exit code and text of an error meant for the operator. Raises any other error again."""
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
    """Emulate the roller bench and its PLC, and explain what its logs show."""
