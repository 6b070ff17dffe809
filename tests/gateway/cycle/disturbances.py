"""Ways in which readings of the PLC go wrong, as a closed loop takes them."""

from dataclasses import replace

from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop

CONFIG = Config().with_values({"truck.crr": "0.0117"})


def left_run_after(loop, within=0.4):
    """Time from now until RUN is left [s]."""
    begin = loop.now
    while loop.last.state is State.RUN:
        assert loop.now - begin < within, "still in RUN"
        loop.run(SCAN)
    return loop.now - begin


def fault(reason):
    return lambda loop, reading: reason


def frozen(loop, reading):
    return getattr(loop, "_frozen", None) or loop.__dict__.setdefault("_frozen", reading)


def torn(loop, reading):
    return replace(reading, sequence_end=reading.sequence_start - 1)


def no_heartbeat(loop, reading):
    held = loop.__dict__.setdefault("_beat", reading.plc_heartbeat)
    return replace(reading, plc_heartbeat=held)


def no_sequence(loop, reading):
    held = loop.__dict__.setdefault("_sequence", reading.sequence_start)
    return replace(reading, sequence_start=held, sequence_end=held)


def alarmed(alarm):
    return lambda loop, reading: replace(reading, alarm=alarm)


def without(status):
    return lambda loop, reading: replace(reading, status=reading.status & ~status)


def opened(interlock):
    return lambda loop, reading: replace(reading, interlock=reading.interlock & ~interlock)


def no_echo(loop, reading):
    held = loop.__dict__.setdefault("_echo", reading.command_sequence_echo)
    return replace(reading, command_sequence_echo=held)


def clock_stands(loop, reading):
    held = loop.__dict__.setdefault("_time", reading.plc_time)
    return replace(reading, plc_time=held)


def clock_backwards(loop, reading):
    return replace(reading, plc_time=1000.0 - reading.plc_time)


def clock_at(factor):
    """A clock of this rate from now on, without a step."""
    started = []

    def at_rate(_, reading):
        started.append(reading.plc_time)
        passed = reading.plc_time - started[0]
        return replace(reading, plc_time=started[0] + factor * passed)

    return at_rate


def torque_grows(loop, reading):
    """10 N m s more at every sample of 10 ms are 1000 N m."""
    more = 10.0 * loop.plc.scans
    return replace(reading, shaft_torque_integral=reading.shaft_torque_integral + more)


def other_echo(loop, reading):
    """The block of another master, taken over now and then between ours."""
    if loop.plc.scans % 4:
        return reading
    return replace(reading, command_sequence_echo=(reading.command_sequence_echo + 20000) % 65536)


def again(loop, reading):
    """The last reading once more."""
    return loop.observations[-1].measurement


def without_echo():
    """A running loop over a map that has no echo of the command's number."""
    loop = ClosedLoop(CONFIG)
    kept = [one for one in loop.map.registers if one.signal != "command_sequence_echo"]
    loop.map = replace(loop.map, registers=tuple(kept))
    loop.start()
    loop.run(4.5)
    return loop
