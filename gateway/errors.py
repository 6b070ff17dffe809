"""The errors of the gateway, by origin: the operator's input, the PLC, this software.

The command line shows an error that has an `exit_code` as one line, and exits with that code.
"""


class GatewayError(Exception):
    """A request failed. Base class of all errors of the gateway; exit code 1."""

    exit_code = 1


class ConfigError(GatewayError):
    """Bad input: what is wrong, its place, the value found and the value expected; exit code 2."""

    exit_code = 2

    def __init__(
        self,
        what: str,
        *,
        file: object = None,
        place: str | None = None,
        value: object = None,
        expected: str | None = None,
    ) -> None:
        self.file, self.place, self.value, self.expected = file, place, value, expected
        where = "".join(f"{part}: " for part in (file, place) if part is not None)
        found = "" if value is None else f", found {value!r}"
        right = "" if expected is None else f"; expected {expected}"
        super().__init__(f"{where}{what}{found}{right}")


class RecordingError(ConfigError):
    """A file that is no recording, or that cannot be written as one."""


class PlcError(GatewayError):
    """Fault of the PLC or the link: no reply, a refusal, or a reply to something else."""


class BugError(GatewayError):
    """Mistake in this software: a state that should have been impossible."""
