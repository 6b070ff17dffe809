"""Parameters of commands: finite numbers and output files, and a command that guards its files."""

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import click

LONGEST: Final = 3600.0
"""[s] Longest wait that an option accepts."""
PICTURES: Final = ("", ".png", ".pdf", ".svg")
"""Endings that the name of a picture may have."""


class Number(click.FloatRange):
    """A finite number within a range."""

    name = "number"

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        """Refuse a text that is no number, and NaN and infinity."""
        found: float = super().convert(value, param, ctx)
        if not math.isfinite(found):
            self.fail(f"{value}: a finite number is expected.", param, ctx)
        return found


class OutputFile(click.Path):
    """A file to write. A file that cannot be written is refused before any work.

    dash : `-` may stand for standard output
    endings : endings that the name may have, None: any
    """

    def __init__(
        self,
        *,
        dash: bool = False,
        endings: tuple[str, ...] | None = None,
        path_type: type | None = None,
    ) -> None:
        super().__init__(dir_okay=False, allow_dash=dash, path_type=path_type)
        self.endings = endings

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Try to open the file; a file that did not exist is removed again."""
        found = super().convert(value, param, ctx)
        if why := "" if self.allow_dash and str(value) == "-" else self.objection(str(value)):
            self.fail(f"{str(value)!r}: {why}", param, ctx)
        return found

    def objection(self, name: str) -> str:
        """Why no file of this name can be written; empty: it can."""
        path = Path(name)
        if not name:
            return "the name of a file is expected"
        if self.endings is not None and path.suffix.lower() not in self.endings:
            return f"a name that ends in {', '.join(filter(None, self.endings))} is expected"
        return obstacle(path)


def obstacle(path: Path) -> str:
    """Why a file cannot be opened for writing; empty: it can.

    Pipes and devices are not tried, because opening one may wait and closing it may end its reader.
    """
    there = os.path.lexists(path)
    if there and not path.is_file():
        return ""
    try:
        path.open("ab").close()
    except OSError as error:
        return error.strerror or str(error)
    if not there:
        path.unlink()
    return ""


class Command(click.Command):
    """A command that guards its files and names its options.

    It never writes an output over one of its inputs or over another output. An error of the library
    that names an argument is told with the option of that argument.
    """

    def invoke(self, ctx: click.Context) -> Any:
        """Check every output, then run the command."""
        outputs: list[tuple[click.Parameter, Path]] = []
        for option in self.params:
            value = ctx.params.get(option.name or "")
            if isinstance(option.type, OutputFile) and value is not None and str(value) != "-":
                self.refuse(option, Path(value), outputs, ctx)
                outputs.append((option, Path(value)))
        try:
            return super().invoke(ctx)
        except Exception as error:
            for option in self.params:
                if option.name and option.name == getattr(error, "argument", ""):
                    text = str(error).removeprefix(option.name)
                    error.args = (f"{option.opts[0]}{text}",)
            raise

    def refuse(
        self,
        option: click.Parameter,
        path: Path,
        outputs: list[tuple[click.Parameter, Path]],
        ctx: click.Context,
    ) -> None:
        """Raise BadParameter where this output is also another output or an input."""
        for other, written in outputs:
            if is_same(path, written):
                raise click.BadParameter(
                    f"{str(path)!r}: {other.opts[0]} is written there too", ctx, option
                )
        for other in self.params:
            if isinstance(other.type, OutputFile):
                continue
            if any(is_same(path, read) for read in files(ctx.params.get(other.name or ""))):
                raise click.BadParameter(
                    f"{str(path)!r}: is also {other.get_error_hint(ctx)}, which would be lost",
                    ctx,
                    option,
                )


def files(value: Any) -> Iterator[Path]:
    """Existing files that a parameter may name, written FILE, KEY=FILE or FILE:VALUES."""
    if isinstance(value, (tuple, list)):
        for part in value:
            yield from files(part)
    elif isinstance(value, (str, Path)):
        text = str(value)
        names = {text, text.partition("=")[2].strip("\"'"), text.partition(":")[0]}
        yield from (Path(name) for name in names if os.path.isfile(name))  # noqa: PTH113 - Path.is_file raises where a text is too long for a name


def is_same(first: Path, second: Path) -> bool:
    """Whether two names are or would be one file. A device or a pipe may be named twice."""
    if first.exists() and second.exists():
        return first.is_file() and first.samefile(second)
    return os.path.realpath(first) == os.path.realpath(second)
