"""What can go wrong, by who did it: the operator (ConfigError), the peer (PlcError), we (BugError).

The command line shows any error that carries `exit_code` as one line and exits with that code.
"""


class GatewayError(Exception):
    """The thing asked for failed."""

    exit_code = 1


class ConfigError(GatewayError):
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


class PlcError(GatewayError):
    """The peer did wrong: no answer, a refusal, or an answer that does not fit the question."""


class BugError(GatewayError):
    """We did wrong: a state that our own code should have made impossible."""
