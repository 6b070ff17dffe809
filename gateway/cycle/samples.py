"""The samples of the PLC: which reading is new, how old it is, and the window between two samples.

A PLC that is polled as fast as it scans sometimes shows one sample twice. Such a repetition is
neither new nor a fault. A sample is stale when heartbeat or sequence number have not moved for too
long. A lost poll is bridged, because the torque integral and the speeds of the next sample span the
gap.

The regulator never sees an impossible window. A window is impossible when the PLC's clock has not
advanced over it, or has advanced unlike our clock, or when no sensor could show its mean torque.
One such window is left out. When no usable window has come for too long, there is no fresh sample.

A sample number or a clock that jumps back tells of a PLC that has restarted. What it shows right
after its start is not believed, because its inputs may not have been read yet.
"""

from dataclasses import dataclass, replace
from math import exp, inf

from gateway.configuration.config import Config
from gateway.configuration.sections import RegulatorConfig
from gateway.friction.law import oil_temperature
from gateway.physics.window import Window
from gateway.reasons import Reason
from register_maps.codec import difference
from register_maps.register_map import RegisterMap
from register_maps.signals import Measurement
from register_maps.timing import SCAN

LINK_IS_DOWN = frozenset({Reason.NOT_CONNECTED, Reason.CONNECTION_LOST})
"""Faults that waiting for the next poll does not cure."""
OUT_OF_STEP, CLOCK_JITTER = 0.5, 0.05
"""Allowed difference of two clocks over a window: a share of the window, and an addition [s]."""
FASTEST, LEAP = 1e-3, 100
"""[s] Shortest period of a PLC, and samples to spare. A sample number that leads by more than the
time allows belongs to a counter that started anew behind the middle of its range."""
FORGOTTEN = 1.0
"""[s] Age of the newest sample from which its first fault is history."""
RESTARTING = 1.0
"""[s] Time after a restart during which no sample counts as fresh."""
CLOCK_MEMORY = 0.5
"""[s] Time over which a clock that is always too fast or too slow is noticed."""
TORQUE_MISMATCH, TORQUE_SWING = 20.0, 200.0
"""[N m] Allowed difference of a window's mean torque from the PLC's mean over its last scan. The
first number holds for a window of one scan; the second is added for a window of many scans."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """The last two samples of the PLC, and the window between them. Times are those of our clock.

    newest, before : the last good reading, and the other sample before it
    heartbeat_moved, sequence_moved : times of their last change [s]
    fault, last_fault : the first fault since the last good reading, and the last one
    down : the link is known to be gone
    is_new : this tick has brought a new sample
    before_came : time at which the sample before came [s]
    window : the window between the two samples, None: no new sample, or an impossible window
    used : time of the last usable window [s]
    window_fault : why a later window is impossible
    oil : temperature of the gear's oil after the last window [K], None: unknown
    ahead : lead of the PLC's clock over ours within the last CLOCK_MEMORY [s]
    restarted : time at which the PLC was last found to have restarted [s]
    """

    newest: Measurement | None = None
    before: Measurement | None = None
    heartbeat_moved: float = -inf
    sequence_moved: float = -inf
    fault: Reason | None = None
    last_fault: Reason | None = None
    down: bool = False
    is_new: bool = False
    before_came: float = -inf
    window: Window | None = None
    used: float = -inf
    window_fault: Reason = Reason.STALE
    oil: float | None = None
    ahead: float = 0.0
    restarted: float = -inf

    def age(self, now: float) -> float:
        """Age of the newest sample at this time [s]."""
        return now - min(self.heartbeat_moved, self.sequence_moved)


def take(
    samples: Samples, measurement: Measurement | None, fault: Reason | None, now: float
) -> Samples:
    """Return the samples after one reading at `now` [s]; `with_window` adds its window."""
    samples = replace(samples, is_new=False, window=None)
    if measurement is None:
        first = samples.fault or fault or Reason.STALE
        return replace(
            samples, fault=first, last_fault=fault or Reason.STALE, down=fault in LINK_IS_DOWN
        )
    if measurement.sequence_start != measurement.sequence_end:
        return replace(samples, fault=samples.fault or Reason.TORN_IMAGE, down=False)
    last = samples.newest
    beats = last is None or measurement.plc_heartbeat != last.plc_heartbeat
    moves = last is None or measurement.sequence_start != last.sequence_start
    return replace(
        samples,
        newest=measurement,
        before=last if moves else samples.before,
        before_came=samples.sequence_moved if moves else samples.before_came,
        heartbeat_moved=now if beats else samples.heartbeat_moved,
        sequence_moved=now if moves else samples.sequence_moved,
        fault=None,
        last_fault=None,
        down=False,
        is_new=moves,
    )


def fault(samples: Samples, now: float, stale: float) -> Reason | None:
    """Reason for which there is no fresh sample; None: there is one. now, stale [s].

    The first fault is the cause. After FORGOTTEN the last one tells what is wrong now.
    """
    if samples.last_fault is not None and samples.age(now) > FORGOTTEN:
        return samples.last_fault
    if samples.down or samples.newest is None:
        return samples.fault or Reason.STALE
    if now - samples.restarted <= RESTARTING:
        return Reason.PLC_RESTARTED
    if samples.age(now) <= stale:
        return samples.window_fault if now - samples.used > stale else None
    if samples.fault is not None:
        return samples.fault
    frozen = samples.heartbeat_moved <= samples.sequence_moved
    return Reason.HEARTBEAT_FROZEN if frozen else Reason.SEQUENCE_FROZEN


def with_window(config: Config, register_map: RegisterMap, samples: Samples) -> Samples:
    """Return the samples with the window that a new sample ends, or with its fault."""
    now, before = samples.newest, samples.before
    if not samples.is_new or now is None or before is None:
        return samples
    own = samples.sequence_moved - samples.before_came
    duration = difference(now.plc_time, before.plc_time, register_map.modulus("plc_time"))
    if duration < 0.0 or not _follows(register_map, now, before, own):
        moved = samples.sequence_moved
        return replace(samples, restarted=moved, window_fault=Reason.PLC_RESTARTED)
    if not _in_step(duration, own):
        return replace(samples, window_fault=Reason.PLC_CLOCK)
    samples = replace(samples, ahead=samples.ahead * exp(-own / CLOCK_MEMORY) + duration - own)
    if abs(samples.ahead) > OUT_OF_STEP * CLOCK_MEMORY:
        return replace(samples, window_fault=Reason.PLC_CLOCK)
    torque = torque_of(config.regulator.torque, register_map, now, before, duration)
    if not _is_possible(register_map, torque, now.shaft_torque_mean, duration):
        return replace(samples, window_fault=Reason.TORQUE_IMPLAUSIBLE)
    shell = _shell_temperature(now)
    gear_speed = now.motor_speed / config.bench.gear_ratio
    oil = oil_temperature(samples.oil, gear_speed, shell, duration, config.regulator.friction)
    window = Window(
        duration=duration,
        shaft_torque=without_sensor(config.regulator, torque, now, before, duration),
        motor_speed=now.motor_speed,
        drum_speed=now.drum_speed,
        drum_speed_change=now.drum_speed - before.drum_speed,
        shell_temperature=shell,
        oil_temperature=oil,
    )
    return replace(samples, window=window, used=samples.sequence_moved, oil=oil)


def _follows(register_map: RegisterMap, now: Measurement, before: Measurement, own: float) -> bool:
    """Whether a sample number may follow another after this time by our clock [s]."""
    span = register_map.modulus("sequence_start")
    return 0.0 < difference(now.sequence_start, before.sequence_start, span) < own / FASTEST + LEAP


def _in_step(duration: float, own: float) -> bool:
    """Whether a window took about as long by the PLC's clock as by ours [s]."""
    allowed = OUT_OF_STEP * max(duration, own) + CLOCK_JITTER
    return duration > 0.0 and abs(duration - own) <= allowed


def _is_possible(
    register_map: RegisterMap, torque: float, of_scan: float | None, duration: float
) -> bool:
    """Whether a sensor may have shown this mean torque [N m]; `of_scan` is the PLC's own mean."""
    register = register_map.register("shaft_torque")
    if register is not None:
        lowest, highest = sorted(register.si_unit.to_si(end) for end in register.range)
        if not lowest <= torque <= highest:
            return False
    if of_scan is None:
        return True
    unseen = max(0.0, 1.0 - SCAN / duration)
    return abs(torque - of_scan) <= TORQUE_MISMATCH + TORQUE_SWING * unseen


NEEDS = {
    "integrated": "shaft_torque_integral",
    "averaged": "shaft_torque_mean",
    "instantaneous": "shaft_torque",
}
"""Signal that each choice of `regulator.torque` reads."""


def torque_of(
    kind: str, register_map: RegisterMap, now: Measurement, before: Measurement, duration: float
) -> float:
    """Torque of the window [N m]; the torque at its end where a sample lacks the needed signal."""
    if kind == "averaged" and now.shaft_torque_mean is not None:
        return now.shaft_torque_mean
    last, first = now.shaft_torque_integral, before.shaft_torque_integral
    if kind == "integrated" and last is not None and first is not None:
        return difference(last, first, register_map.modulus("shaft_torque_integral")) / duration
    return now.shaft_torque


def without_sensor(
    regulator: RegulatorConfig,
    torque: float,
    now: Measurement,
    before: Measurement,
    duration: float,
) -> float:
    """Torque of the shaft behind the torque that its sensor shows over a window [N m].

    A sensor of first order shows T with tau T_meas' + T_meas = T. Over a window the slope is that
    between its ends, so that noise does not add up from window to window.
    """
    slope = (now.shaft_torque - before.shaft_torque) / duration
    return float(regulator.shaft_torque(torque + regulator.torque_lag * slope))


def _shell_temperature(measurement: Measurement) -> float | None:
    """Mean of the thermocouples that work [K]; None: none works."""
    both = (measurement.shell_temperature_1, measurement.shell_temperature_2)
    working = [one for one in both if one is not None]
    return sum(working) / len(working) if working else None
