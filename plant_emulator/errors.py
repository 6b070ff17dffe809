"""What can go wrong. The command line shows any error that carries `exit_code` as one line."""


class EmulatorError(Exception):
    """The thing asked for failed."""

    exit_code = 1


class InputError(EmulatorError):
    """Bad input: what is wrong, where, the value found, and what would be right."""

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


class ParameterError(InputError):
    """A parameter, parameter set or effect that does not exist or cannot hold the value."""


class LogError(InputError):
    """A log file that cannot be read; `place` names line and column."""
