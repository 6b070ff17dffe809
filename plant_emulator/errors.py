"""What can go wrong. The command line shows any error that carries `exit_code` as one line."""


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
