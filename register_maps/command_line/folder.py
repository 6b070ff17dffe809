"""A command line whose commands are the modules of a package, each found by its file name.

Module `two_words.py` holds `command` and is called `two-words`. A leading underscore makes a module
no command. `--help` shows the first line of each docstring and therefore imports no command.
"""

import ast
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import click


class CommandFolder(click.Group):
    """The commands of one package; a command is imported only when it is called.

    package : name of the package, already imported
    """

    def __init__(self, *, package: str, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.package = package
        self.folder = Path(sys.modules[package].__path__[0])

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Names of all commands, sorted."""
        files = self.folder.glob("[!_]*.py")
        return sorted(file.stem.replace("_", "-") for file in files)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command; None where the package has no such module."""
        if cmd_name not in self.list_commands(ctx):
            return None
        module = import_module(f"{self.package}.{cmd_name.replace('-', '_')}")
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing any."""
        rows = [(name, self.summary(name)) for name in self.list_commands(ctx)]
        if rows:
            with formatter.section("Commands"):
                formatter.write_dl(rows)

    def summary(self, name: str) -> str:
        """First line of a command's docstring, read without importing its module."""
        text = (self.folder / f"{name.replace('-', '_')}.py").read_text("utf-8")
        return (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]

    def main(self, *args: Any, **options: Any) -> Any:
        """Run and exit. Print an error meant for the operator as one line, without a traceback."""
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


def verdict(error: Exception) -> tuple[int, str]:
    """Exit code and text of an error that is meant for the operator.

    Such an error comes from click or the operating system, or has an `exit_code`. Any other error
    is a mistake in this software and is raised again.
    """
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
