"""Is the PLC fast enough for the period? Judged before a run, when there is time to say no (pure).

In a run, missed deadlines count (OVERRUN). Before it, a tick only reads, so that a run will take
twice as long.
"""

from math import exp

from gateway.reasons import Reason

SHARE_MEMORY = 0.5
"""[s] Time over which the share of slow ticks is taken: single late replies do not count."""
MOST_LATE = 0.5
"""Share of slow ticks from which a PLC is too slow."""


def slow(share: float, latency: float, *, writes: bool, period: float) -> float:
    """Share of slow ticks after one more, which took `latency` [s]; `writes` : it also wrote."""
    took = latency if writes else 2.0 * latency
    return share + (1.0 - exp(-period / SHARE_MEMORY)) * ((took > period) - share)


def reason(share: float) -> Reason | None:
    """Reason where too many ticks are slow; None: the PLC is fast enough.

    share : of slow ticks [1]
    """
    return Reason.TOO_SLOW if share > MOST_LATE else None
