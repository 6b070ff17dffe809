"""The emulated PLC: one `scan` every 10 ms around a bench. It has no clock and no socket.

A scan has four steps. It simulates the bench up to now, under the reference of the previous scan.
It reads the command. It decides the state and the reference of the next 10 ms. It returns a
measurement. A command therefore acts in the scan that first reads it.

An accepted command with a changed heartbeat feeds the watchdog. When the watchdog expires, the PLC
ramps the drum down. Then only a rising edge of CTRL.enable starts the bench, like after any stop.
An alarm stays until a rising edge of CTRL.fault_reset, or until the operator moves the remote
switch.
"""

from collections.abc import Sequence
from math import floor, inf, pi

from plant_emulator.emulator.plc import reference
from plant_emulator.emulator.plc.command import Inbox
from plant_emulator.emulator.plc.fast_task import FastTask
from plant_emulator.emulator.plc.state import RUNNING, TRANSITIONS, Event
from plant_emulator.emulator.plc.surroundings import CLOSED, Backlash, SteppedBench, Switches, Truck
from plant_emulator.simulation.running_bench import BenchSamples
from register_maps.register_map import RegisterMap
from register_maps.signals import Alarm, Control, Interlock, Measurement, Mode, PlcState, Status
from register_maps.timing import SCAN

STEPS = 10
STEP = SCAN / STEPS

MOTOR_STANDSTILL = 1.0  # motor speed [rad/s], 0.016 rad/s at the drum
# 5 % above the largest reference, because the drive overshoots a ramp by less than 1 %.
OVERSPEED = 1.05 * reference.SPEED_MAX
# [K] The gear counts as cold below 30 degC; its nominal friction belongs to about 32 degC.
COLD_BELOW = 303.15
PULSES_PER_REVOLUTION = 4096
DRIVEN = (Mode.SPEED, Mode.ROAD_LOAD)


class Plc:
    """The PLC's program and its state. `scan` runs it once.

    samples : the bench's signals in the last scan
    """

    samples: BenchSamples

    def __init__(
        self,
        bench: SteppedBench,
        register_map: RegisterMap,
        *,
        backlash: Backlash,
        truck: Truck | None = None,
    ) -> None:
        self.bench, self.register_map = bench, register_map
        self.backlash, self.truck = backlash, truck
        self.scans = self._started = 0
        self.state = PlcState.INIT
        self.alarm = Alarm(0)
        self.inbox = Inbox(register_map)
        self.path = [0.0] * STEPS
        self.reference = 0.0
        self.fast_task = FastTask(STEP)
        self.switches = Switches()
        self.road_load_since: float | None = None
        self._at_limit = False
        self._current_limit = self.inbox.command.current_limit
        field = register_map.register("field_current")
        # The bench has no field circuit. A map without a "not available" mark shows zero.
        self._field_current = None if field is None or field.not_available is not None else 0.0
        self._age_max = _largest(register_map, "command_age")
        self._scan_time_max = _largest(register_map, "scan_time_max")

    @property
    def time(self) -> float:
        """PLC time: the time of the last measurement [s]."""
        return self.scans * SCAN

    def restart(self) -> None:
        """Start the PLC anew: counters, clock, command and state; the bench keeps its motion.

        `time` goes on, because it is the time of the experiment.
        """
        self._started = self.scans
        self.state, self.alarm = PlcState.INIT, Alarm(0)
        self.inbox = Inbox(self.register_map)
        self.path = [0.0] * STEPS
        self.fast_task = FastTask(STEP)
        self.road_load_since = None
        if self.truck is not None:
            self.truck.follow(self.state, self.time)

    def scan(
        self, words: Sequence[int] | None, switches: Switches, scan_time_max: float = 0.0
    ) -> Measurement:
        """Run one scan and return its measurement.

        words : the command block now; None before the first write
        scan_time_max : longest scan so far [s], measured by the caller
        """
        self._advance()
        self.scans += 1
        moved = switches.remote != self.switches.remote
        self.switches = switches
        if not self.inbox.read(words, self.time):
            self.alarm |= Alarm.SETPOINT_REJECTED
        acknowledged = moved or Control.FAULT_RESET in self.inbox.edges
        if acknowledged:
            self.alarm = Alarm(0)
        self._decide(acknowledged)
        self._plan()
        return self._measurement(scan_time_max)

    def _advance(self) -> None:
        wheel, brake = 0.0, 0.0
        if self.truck is not None and self.scans:
            wheel, brake = self.truck.torques(self.time, self.samples.felt_drum_speed)
        self.samples = self.bench.advance(self.path, wheel_torque=wheel, brake_torque=brake)
        self.fast_task.take(self.samples.shaft_torque)

    def _decide(self, acknowledged: bool) -> None:
        """Go to the next state if an event asks for one."""
        if self.samples.motor_speed[-1] > OVERSPEED:
            self.alarm |= Alarm.OVERSPEED
        for event in self._events(acknowledged):
            if (self.state, event) in TRANSITIONS:
                self._enter(TRANSITIONS[self.state, event])
                return

    def _events(self, acknowledged: bool) -> list[Event]:
        command, remote = self.inbox.command, self.switches.remote
        wanted = Control.ENABLE in command.control and command.mode in DRIVEN
        runs = wanted and remote and self.inbox.watchdog_ok(self.time)
        starts = runs and Control.ENABLE in self.inbox.edges
        tripped = self.switches.interlock != CLOSED or Alarm.OVERSPEED in self.alarm
        stands = abs(float(self.samples.motor_speed[-1])) < MOTOR_STANDSTILL
        road_load = command.mode is Mode.ROAD_LOAD
        happens = {
            Event.TRIPPED: tripped,
            Event.RESET: acknowledged,
            Event.STARTED: True,
            Event.STOP: not runs,
            Event.STOPPED: stands and self.path[-1] == 0.0,
            Event.START_SPEED: starts and not road_load,
            Event.START_ROAD_LOAD: starts and road_load,
            Event.TO_SPEED: not road_load,
            Event.TO_ROAD_LOAD: road_load,
        }
        return [event for event in Event if happens[event]]

    def _enter(self, state: PlcState) -> None:
        if state is PlcState.RAMP_DOWN and not self.inbox.watchdog_ok(self.time):
            self.alarm |= Alarm.COMMUNICATION
        if state is PlcState.ROAD_LOAD:
            self.road_load_since = self.time
        if self.truck is not None:
            self.truck.follow(state, self.time)
        self.state = state

    def _plan(self) -> None:
        """Plan the reference of the next scan and set the drive's current limit."""
        if self.inbox.command.current_limit != self._current_limit:
            self._current_limit = self.inbox.command.current_limit
            self.bench.limit_current(self._current_limit)
        target = self._target()
        self.reference = self.path[-1]
        self.path = reference.trajectory(self.reference, target, STEP, STEPS)
        current = abs(float(self.samples.armature_current[-1]))
        self._at_limit = (
            reference.is_limited(self.path, target, STEP)
            or current > 0.999 * self.inbox.command.current_limit
        )

    def _target(self) -> reference.Target:
        if self.state in RUNNING:
            return reference.Target(
                speed=self.inbox.command.speed,
                slope=self.inbox.command.rate,
                slew=self.inbox.command.slew,
                age=self.inbox.age(self.time),
            )
        if self.state is PlcState.FAULT:
            return reference.STOP_AT_ONCE
        return reference.ramp_down(self.inbox.command.slew)

    def _status(self) -> Status:
        temperature = self.samples.shell_temperature
        twist = self.backlash.twist(self.samples.motor_angle, self.samples.drum_angle)
        bits = {
            Status.READY: self.state is PlcState.READY,
            Status.ENABLED: self.state in RUNNING,
            Status.REMOTE: self.switches.remote,
            Status.ROAD_LOAD: self.state is PlcState.ROAD_LOAD,
            Status.AT_LIMIT: self._at_limit,
            Status.GAP: abs(twist) < self.backlash.half_gap,
            Status.WARM: temperature > COLD_BELOW,
            Status.WATCHDOG_OK: self.inbox.watchdog_ok(self.time),
            Status.EMERGENCY_STOP_OK: Interlock.EMERGENCY_STOP in self.switches.interlock,
            Status.FAULT: self.state is PlcState.FAULT,
        }
        return Status(sum(bit for bit, holds in bits.items() if holds))

    def _measurement(self, scan_time_max: float) -> Measurement:
        now, scans = self.samples, self.scans - self._started
        return Measurement(
            sequence_start=scans,
            plc_heartbeat=scans,
            plc_time=scans * SCAN,
            status=self._status(),
            plc_state=self.state,
            alarm=self.alarm,
            alarm_reserved=0,
            motor_speed=float(now.motor_speed[-1]),
            drum_speed=float(now.drum_speed[-1]),
            shaft_torque=self.fast_task.torque,
            shaft_torque_mean=self.fast_task.mean,
            armature_current=float(now.armature_current[-1]),
            armature_voltage=float(now.armature_voltage[-1]),
            speed_reference=self.path[-1],
            shell_temperature_1=now.shell_temperature,
            shell_temperature_2=now.shell_temperature,
            field_current=self._field_current,
            shaft_torque_integral=self.fast_task.integral,
            drum_count=_pulses(now.drum_angle),
            motor_count=_pulses(now.motor_angle),
            command_sequence_echo=self.inbox.command.sequence,
            command_age=min(self.inbox.age(self.time), self._age_max),
            scan_time_max=min(scan_time_max, self._scan_time_max),
            interlock=self.switches.interlock,
            sequence_end=scans,
        )


def _pulses(angle: float) -> int:
    """Encoder pulses after a turn by `angle` [rad]; the codec wraps them."""
    return floor(angle * PULSES_PER_REVOLUTION / (2 * pi))


def _largest(register_map: RegisterMap, signal: str) -> float:
    """Largest SI value that the signal's register can show; infinite without a register."""
    register = register_map.register(signal)
    if register is None:
        return inf
    return register.si_unit.to_si(register.raw.high * register.scale + register.offset)
