"""The reference that the PLC gives its drive between the samples of a recording (pure).

At the start of each scan, the PLC takes the last command. From where its reference is, it goes to
the line of that command as fast as the slew rate allows, and then along the line. At a sample, the
PLC says where the reference will be at the end of the next scan, and the number and the age of its
command. So the reference of a scan whose sample the gateway did not read is known as well.
"""

from typing import Any, Final, NamedTuple

import numpy as np

from gateway.arrays import Array
from register_maps.timing import HOLD, SCAN

LIMITED: Final = 0.98
"""Share of a scan that a limited PLC needs at least; its registers round."""
LIKE_THE_PLC: Final = 0.05
"""Largest miss of a reference that follows a command as the PLC does [rad/s]. The registers round
it: in 4566 scans, the largest miss was 0.019."""
FIELDS: Final = ("speed_setpoint", "speed_rate", "ramp_limit", "command_sequence")
KNOWN: Final = 4
"""Number of commands before a tick that the PLC may follow at it or in the scan before it, and one
more."""
NO_COMMANDS: Final = np.full((len(FIELDS), KNOWN), np.nan)


class Followed(NamedTuple):
    """Commands by tick, shape (4, ticks): speed [rad/s], rate, slew [rad/s^2] and number.

    now : that the PLC follows at the tick; before, earlier : the one before it, and before that
    """

    now: Array
    before: Array
    earlier: Array


class Samples(NamedTuple):
    """What the PLC says at samples, shape (n,): number and age [s] of its command, and the
    reference at the end of the next scan [rad/s]."""

    number: Array
    age: Array
    told: Array


def commands(records: Any, before: Array) -> tuple[Followed, Array]:
    """The commands that the PLC follows at each tick, and the last ones, shape (4, 4).

    The PLC follows the command of the tick before, or of the one before that, and tells its number.

    before : the last commands of the records before, as they are returned
    """
    written = np.stack([records[f"setpoint_{name}"] for name in FIELDS])
    known = np.concatenate([before, written], axis=1)
    last, second, third, fourth = (known[:, k : k - KNOWN] for k in range(KNOWN - 1, -1, -1))
    older = records["measured_command_sequence_echo"] == second[3]
    recent = ((second, last), (third, second), (fourth, third))
    return Followed(*(np.where(older, *pair) for pair in recent)), known[:, -KNOWN:]


class ReferencePath(NamedTuple):
    """The reference of samples.

    begin : at each sample [rad/s], shape (n,)
    knees : up to three corners behind each sample, seconds after it (0: none) and value [rad/s] in
        turn, shape (6, n)
    ahead : second and third corner of the sample before the first one, shape (4,)
    """

    begin: Array
    knees: Array
    ahead: Array


def path_between(
    before: Samples, after: Samples, followed: Followed, steps: Array
) -> ReferencePath:
    """The reference at samples, and its corners behind them.

    In the scan after a sample, it has the corner where it meets the line of the command. Where the
    gateway read no sample of just one scan, it has the end of the scan before that one as second
    corner, and that of the lost scan as third. Across a longer hole, or where the PLC does not
    follow its commands as this module does, it is a line.

    before, after : what is said at the sample before each sample, and at the sample
    followed : commands at the samples; steps : since the sample before [s]
    """
    command, age = _lost_command(before, after, followed)
    lost = _follow(before.told, command, age)
    missed = np.abs(_follow(lost, followed.now, after.age) - after.told)
    known = (np.rint(steps / SCAN) == 2.0) & (missed < LIKE_THE_PLC)
    share = np.maximum(steps - SCAN, 0.0) / np.maximum(steps, SCAN)
    line = before.told + share * (after.told - before.told)
    begin = np.where(known, lost, line)
    first = knees_of(begin, after.told, *np.nan_to_num(followed.now[1:3]))
    third = knees_of(before.told, lost, *np.nan_to_num(command[1:3]))
    third[0] += SCAN
    hidden = np.where(known, np.stack([np.full_like(lost, SCAN), before.told, *third]), 0.0)
    # The corners in the hole before a sample stand behind the sample before it.
    knees = np.concatenate([first, np.pad(hidden[:, 1:], ((0, 0), (0, 1)))])
    return ReferencePath(begin, knees, hidden[:, 0])


def _lost_command(before: Samples, after: Samples, followed: Followed) -> tuple[Array, Array]:
    """Command in the lost scan before each sample, and its age at the start of that scan [s].

    NaN: nobody knows which command the PLC had.
    """
    taken = after.age >= 0.5 * SCAN  # the PLC took the command in the lost scan, or before it
    command = np.where(taken, followed.now, followed.before)
    repeated = command[3] == before.number
    # A command between two that the PLC told may have been overwritten before the PLC took it.
    sure = taken | repeated | (followed.earlier[3] == before.number)
    command = np.where(sure, command, np.nan)
    age = np.where(taken, after.age - SCAN, np.where(repeated, before.age + SCAN, 0.0))
    return command, age


def _follow(begin: Array, command: Array, age: Array) -> Array:
    """Reference at the end of a scan [rad/s] in which a command has this age at the start [s]."""
    speed, rate, slew, _ = command
    wanted: Array = np.maximum(speed + rate * np.minimum(age + SCAN, HOLD), 0.0)
    change: Array = np.clip(wanted - begin, -slew * SCAN, slew * SCAN)
    return begin + change


def knees_of(begin: Array, told: Array, rate: Array, slew: Array) -> Array:
    """Knee of the reference in the scan after each sample: seconds after it, and value [rad/s].

    Where the reference does not reach the line, the knee is the end of the scan. Shape (2, n).

    begin, told : where the scan begins and ends [rad/s]
    rate, slew : slope of the command's line, and largest slope [rad/s^2]; slew 0: not known
    """
    jump = told - begin - rate * SCAN
    needed = np.abs(jump) / np.maximum(slew - np.sign(jump) * rate, 1e-9)
    limited = needed >= LIMITED * SCAN
    after = np.where(limited, SCAN, needed)
    return np.stack([after, told - rate * (SCAN - after)])
