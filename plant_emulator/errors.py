"""What can go wrong. The command line shows any error that carries `exit_code` as one line."""

import re
import traceback
from collections.abc import Iterable


class EmulatorError(Exception):
    """The thing asked for failed."""

    exit_code = 1


class InputError(EmulatorError):
    """Bad input. The message says where it stands, what was found, and what would be right."""

    exit_code = 2


class ParameterError(InputError):
    """A parameter, parameter set, program or effect that does not exist or holds no such value."""


class LogError(InputError):
    """A log file that cannot be read; the message names line and column."""


class UnsettledError(EmulatorError):
    """A simulation whose equations were not solved at every step: its numbers mean nothing."""


class IdentificationError(InputError):
    """Logs that cannot be fitted as asked, or a parameter that cannot be free."""


def place_in(files: Iterable[str], error: Exception) -> str | None:
    """What went wrong in one of these files, as `file:line: what`; None: it is none of theirs.

    The place is the innermost line of these files that the error passed through. A compiler's
    error has no such trace; it tells the places in its text, also innermost first.
    """
    known = set(files)
    if isinstance(error, SyntaxError) and error.filename in known:
        return f"{error.filename}:{error.lineno}: {error.msg}"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename in known]
    if frames:
        return f"{frames[-1].filename}:{frames[-1].lineno}: {type(error).__name__}: {error}"
    for file, line in re.findall(r" at (\S.*?) \((\d+)\)", str(error)):
        if file in known:
            said = (text for text in str(error).splitlines() if not text.startswith("Failed in"))
            return f"{file}:{line}: {next(filter(None, said))}"
    return None


class DiagnosisError(InputError):
    """Logs that cannot be diagnosed as asked."""
