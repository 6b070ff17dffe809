"""The errors of the emulator. The command line prints an error with an `exit_code` as one line."""

import re
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager


class EmulatorError(Exception):
    """A request failed. Base class of all errors of the emulator; exit code 1.

    argument : name of the argument that holds the bad value; the message then begins with the name,
        and a command puts its option there
    """

    exit_code = 1

    def __init__(self, message: str = "", *, argument: str = "") -> None:
        self.argument = argument
        super().__init__(f"{argument} {message}" if argument else message)


class InputError(EmulatorError):
    """Bad input. The message names the place, the value found and the value expected."""

    exit_code = 2


class ParameterError(InputError):
    """A parameter, parameter set, program or effect does not exist, or has a bad value."""


class LogError(InputError):
    """A log cannot be read or used. The message names line and column, or time and value."""


class UnsettledError(EmulatorError):
    """The solver did not converge in every step, so the simulation must not be used."""


class IdentificationError(InputError):
    """Logs cannot be fitted as asked, or a parameter cannot be free."""


class DiagnosisError(InputError):
    """Logs cannot be diagnosed as asked."""


@contextmanager
def report_unwritable(path: object) -> Iterator[None]:
    """Raise InputError, which names the file, where the operating system refuses to write it."""
    try:
        yield
    except OSError as error:
        why = error.strerror or str(error)
        raise InputError(f"{path}: {why}; a file that can be written is needed") from error


def place_in(files: Iterable[str], error: Exception) -> str | None:
    """Message `file:line: text` if one of these files caused the error, else None.

    The line is the innermost one of these files in the error's trace. An error of the compiler has
    no such trace. Its text lists the lines instead, innermost first.
    """
    wanted = set(files)
    if isinstance(error, SyntaxError) and error.filename in wanted:
        return f"{error.filename}:{error.lineno}: {error.msg}"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename in wanted]
    if frames:
        return f"{frames[-1].filename}:{frames[-1].lineno}: {type(error).__name__}: {error}"
    for file, line in re.findall(r" at (\S.*?) \((\d+)\)", str(error)):
        if file in wanted:
            texts = (text for text in str(error).splitlines() if not text.startswith("Failed in"))
            return f"{file}:{line}: {next(filter(None, texts))}"
    return None
