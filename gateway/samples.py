"""Which readings are new samples, how old the newest is, and what lies between two of them.

A PLC that is polled as fast as it scans now and then shows the same sample twice: that is neither
news nor a fault. It is stale when heartbeat or sequence number have not moved for too long. A poll
that was lost is bridged: the torque integral and the speeds of the next sample span the gap.
"""

from dataclasses import dataclass, replace
from math import inf

from gateway.config import Config
from gateway.reasons import Reason
from gateway.regulators.window import Window
from register_maps.codec import difference
from register_maps.register_map import RegisterMap
from register_maps.signals import Measurement

LINK_IS_DOWN = frozenset({Reason.NOT_CONNECTED, Reason.CONNECTION_LOST})
"""Faults that no waiting for the next poll cures."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """newest : the last good reading; before : the sample before it that was another one

    heartbeat_moved, sequence_moved : when they last did [s]
    fault : the first since the last good reading; down : the link is known to be gone
    is_new : this tick has brought a new sample
    """

    newest: Measurement | None = None
    before: Measurement | None = None
    heartbeat_moved: float = -inf
    sequence_moved: float = -inf
    fault: Reason | None = None
    down: bool = False
    is_new: bool = False

    def age(self, now: float) -> float:
        """Age of the newest sample [s]."""
        return now - min(self.heartbeat_moved, self.sequence_moved)


def take(
    samples: Samples, measurement: Measurement | None, fault: Reason | None, now: float
) -> Samples:
    """Samples after one reading."""
    if measurement is None:
        first = samples.fault or fault or Reason.STALE
        return replace(samples, fault=first, down=fault in LINK_IS_DOWN, is_new=False)
    if measurement.sequence_start != measurement.sequence_end:
        first = samples.fault or Reason.TORN_IMAGE
        return replace(samples, fault=first, down=False, is_new=False)
    last = samples.newest
    beats = last is None or measurement.plc_heartbeat != last.plc_heartbeat
    moves = last is None or measurement.sequence_start != last.sequence_start
    return Samples(
        newest=measurement,
        before=last if moves else samples.before,
        heartbeat_moved=now if beats else samples.heartbeat_moved,
        sequence_moved=now if moves else samples.sequence_moved,
        is_new=moves,
    )


def complaint(samples: Samples, now: float, stale: float) -> Reason | None:
    """Why there is no fresh sample; None: there is one."""
    if samples.down or samples.newest is None:
        return samples.fault or Reason.STALE
    if samples.age(now) <= stale:
        return None
    if samples.fault is not None:
        return samples.fault
    frozen = samples.heartbeat_moved <= samples.sequence_moved
    return Reason.HEARTBEAT_FROZEN if frozen else Reason.SEQUENCE_FROZEN


def window(config: Config, register_map: RegisterMap, samples: Samples) -> Window | None:
    """What happened between the two last samples; None: nothing that can be used."""
    now, before = samples.newest, samples.before
    if not samples.is_new or now is None or before is None:
        return None
    duration = difference(now.plc_time, before.plc_time, register_map.modulus("plc_time"))
    if duration <= 0.0:
        return None
    torque = _torque(config.regulator.torque, register_map, now, before, duration)
    return Window(
        duration=duration,
        shaft_torque=torque - config.regulator.torque_offset,
        motor_speed=now.motor_speed,
        drum_speed=now.drum_speed,
        drum_speed_change=now.drum_speed - before.drum_speed,
        shell_temperature=_shell_temperature(now),
    )


NEEDS = {
    "integrated": "shaft_torque_integral",
    "averaged": "shaft_torque_mean",
    "instantaneous": "shaft_torque",
}
"""The signal that each choice of `regulator.torque` reads."""


def _torque(
    kind: str, register_map: RegisterMap, now: Measurement, before: Measurement, duration: float
) -> float:
    """Torque of the window [N m]; where its signal is missing in a sample, that at its end."""
    if kind == "averaged" and now.shaft_torque_mean is not None:
        return now.shaft_torque_mean
    last, first = now.shaft_torque_integral, before.shaft_torque_integral
    if kind == "integrated" and last is not None and first is not None:
        return difference(last, first, register_map.modulus("shaft_torque_integral")) / duration
    return now.shaft_torque


def _shell_temperature(measurement: Measurement) -> float | None:
    """Mean of the thermocouples that work [K]."""
    both = (measurement.shell_temperature_1, measurement.shell_temperature_2)
    working = [one for one in both if one is not None]
    return sum(working) / len(working) if working else None
