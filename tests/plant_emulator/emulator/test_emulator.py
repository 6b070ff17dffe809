"""The whole emulator without its clock: the simulated bench under the PLC, scan by scan."""

import json
import struct
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from plant_emulator import logs
from plant_emulator.emulator.control_channel import ControlChannel
from plant_emulator.emulator.emulator import Emulator, Options, build, encode
from plant_emulator.emulator.plc import faults
from plant_emulator.emulator.plc.faults import FaultError
from plant_emulator.emulator.plc.plc import Plc
from plant_emulator.emulator.plc.surroundings import CLOSED
from plant_emulator.emulator.server import PlcServer
from plant_emulator.emulator.serving import unsettled_text
from register_maps import load
from register_maps.codec import decode_measurement, encode_setpoint
from register_maps.register_map import MapError
from register_maps.signals import Alarm, Control, Measurement, Mode, PlcState, Setpoint, Status
from tests.plant_emulator.solver.linear_bench import BACKLASH, LinearBench

RPM = 2 * pi / 60


def shown(emulator: Emulator) -> Measurement:
    return decode_measurement(emulator.server.register_map, emulator.server.image)


def drive(emulator: Emulator, scans: int, speed: float = 0.0, *, enable: bool = True) -> None:
    """Run so many scans; command the motor speed `speed` [rad/s] before each."""
    for _ in range(scans):
        number = emulator.plc.scans
        setpoint = Setpoint(
            command_sequence=number,
            gateway_heartbeat=number,
            control=Control.ENABLE if enable else Control(0),
            mode=Mode.ROAD_LOAD,
            speed_setpoint=speed,
            speed_rate=0.0,
            ramp_limit=1000 * RPM,
            current_limit=72.0,
            watchdog_timeout=0.2,
        )
        emulator.server.command = encode_setpoint(emulator.server.register_map, setpoint)
        emulator.scan()


@pytest.fixture
def emulator() -> Emulator:
    """An emulator without a truck, with the remote switch on."""
    return build(Options(truck_mass=None, remote=True, keeps_log=True))


@pytest.mark.parametrize("name", ["bench_int16", "bench_float32"])
def test_bench_at_rest_is_shown_with_the_constants_of_its_map(name):
    emulator = build(Options(map=name, truck_mass=None))
    emulator.scan()
    measurement = shown(emulator)
    assert measurement.plc_state is PlcState.READY
    assert measurement.motor_speed == 0.0
    assert measurement.shell_temperature_1 == pytest.approx(305.15)
    constants = {"bench_int16": (-12345, 0x12345678), "bench_float32": (None, None)}[name]
    assert (measurement.test_int16, measurement.test_uint32) == constants


def test_steady_speed_shows_the_friction_of_the_thesis(emulator):
    # By hand from Table 3.1: -13.4 Nm and 15.7 A at 4025 rpm
    emulator.scan()
    drive(emulator, 1200, 4025 * RPM)
    measurement = shown(emulator)
    assert measurement.motor_speed == pytest.approx(4025 * RPM, rel=1e-3)
    # The drum has no friction and floats slowly through its backlash.
    assert measurement.drum_speed == pytest.approx(4025 * RPM / 62.6, abs=0.05)
    assert measurement.shaft_torque_mean == pytest.approx(-13.4, abs=0.1)
    assert measurement.armature_current == pytest.approx(15.7, abs=0.2)


def test_integral_of_the_torque_is_the_sum_of_the_means(emulator):
    means = []
    emulator.scan()
    for _ in range(50):
        drive(emulator, 1, 500 * RPM)
        means.append(shown(emulator).shaft_torque_mean)
    # Each mean is rounded to 0.01 N m.
    integral = shown(emulator).shaft_torque_integral
    assert integral == pytest.approx(sum(means) * 0.01, abs=50 * 0.005 * 0.01)
    assert integral < -1.0


def test_watchdog_brings_the_real_bench_to_rest(emulator):
    emulator.scan()
    drive(emulator, 300, 2000 * RPM)
    for _ in range(21 + 200 + 100):
        emulator.scan()
    measurement = shown(emulator)
    assert measurement.plc_state is PlcState.READY
    assert abs(measurement.drum_speed) < 0.02
    assert Alarm.COMMUNICATION in measurement.alarm


def test_truck_drives_only_in_road_load():
    emulator = build(Options(truck_mass=3640.0, driver="none", remote=True, keeps_log=True))
    emulator.scan()
    drive(emulator, 400, enable=False)
    assert not emulator.log()["wheel_torque"].any()
    # The driver starts after 2 s.
    drive(emulator, 300)
    assert emulator.log()["wheel_torque"][-1] > 100.0


def test_log_has_one_line_a_scan_and_can_be_read_again(emulator, tmp_path):
    emulator.scan()
    drive(emulator, 99, 100 * RPM)
    emulator.write_log(tmp_path / "run.csv")
    log = logs.read(tmp_path / "run.csv")
    assert np.allclose(np.diff(log.time), 0.01)
    assert len(log.time) == 100
    assert "wheel_torque" not in log


def test_reference_without_a_truck_is_logged_as_it_stands_at_its_time(emulator):
    # The slope is 1000 rpm/s from the second scan on: 0 at its time, 10 rpm 10 ms later.
    emulator.scan()
    drive(emulator, 3, 300 * RPM)
    assert np.allclose(emulator.log()["speed_reference"] / RPM, [0.0, 0.0, 10.0, 20.0])


def test_reference_with_a_truck_is_logged_as_a_staircase():
    emulator = build(Options(truck_mass=3640.0, remote=True, keeps_log=True))
    emulator.scan()
    drive(emulator, 3, 300 * RPM)
    # Mean over the next 10 ms of a ramp in ten steps: 5.5, 15.5, 25.5 rpm.
    assert np.allclose(emulator.log()["speed_reference"] / RPM, [0.0, 5.5, 15.5, 25.5])


def test_remote_after_turns_the_switch_at_its_time():
    emulator = build(Options(truck_mass=None, remote_after=0.05))
    remote = []
    for _ in range(8):
        emulator.scan()
        remote.append(Status.REMOTE in shown(emulator).status)
    assert remote == [False] * 5 + [True] * 3


def test_fault_begins_at_its_time():
    emulator = build(Options(truck_mass=None, faults=("frozen_heartbeat@0.03",)))
    beats = []
    for _ in range(5):
        emulator.scan()
        beats.append(emulator.server.image[1])
    assert beats == [1, 2, 2, 2, 2]


def test_frozen_image_stays_until_the_fault_ends():
    emulator = build(Options(truck_mass=None))
    emulator.scan()
    channel = ControlChannel(emulator, None, lambda: None)
    channel.answer('{"do": "faults", "names": ["frozen_image"]}')
    channel.answer('{"do": "step", "scans": 5}')
    assert shown(emulator).sequence_start == 1
    channel.answer('{"do": "faults", "names": []}')
    channel.answer('{"do": "step", "scans": 1}')
    assert shown(emulator).sequence_start == 7


def test_restart_begins_the_counters_and_forgets_the_command_once():
    emulator = build(Options(truck_mass=None, remote=True))
    emulator.scan()
    drive(emulator, 5, 300 * RPM)
    emulator.faults = (faults.parse("restart@0.08"),)
    samples = []
    for _ in range(6):
        emulator.scan()
        seen = shown(emulator)
        samples.append((seen.sequence_start, round(seen.plc_time, 2)))
    assert samples == [(7, 0.07), (8, 0.08), (1, 0.01), (2, 0.02), (3, 0.03), (4, 0.04)]
    assert Status.ENABLED not in shown(emulator).status
    assert Status.REMOTE in shown(emulator).status
    assert emulator.server.command is None


def test_effects_reach_the_bench():
    cold = build(
        Options(truck_mass=None, remote=True, effects=("torque_sensor_lag:time_constant=0.5",))
    )
    plain = build(Options(truck_mass=None, remote=True))
    for emulator in (cold, plain):
        emulator.scan()
        drive(emulator, 30, 1000 * RPM)
    assert abs(shown(cold).shaft_torque) < 0.8 * abs(shown(plain).shaft_torque)


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"map": "no_such_map"}, MapError),
        ({"faults": ("gremlins",)}, FaultError),
    ],
)
def test_what_does_not_exist_is_refused(options, error):
    with pytest.raises(error):
        build(Options(**options))


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ('{"do": "dance"}', "unknown request"),
        ("no json", "Expecting value"),
        ('{"do": "interlock", "open": ["WINDOW"]}', "WINDOW"),
        ('{"do": "faults", "names": ["gremlins"]}', "unknown fault"),
        ('{"do": "remote"}', "on"),
    ],
)
def test_bad_request_is_answered_and_changes_nothing(emulator, line, what):
    before = emulator.switches
    answer = json.loads(ControlChannel(emulator, None, lambda: None).answer(line))
    assert what in answer["error"]
    assert emulator.switches == before


def test_interlocks_open_and_close_on_request(emulator):
    channel = ControlChannel(emulator, None, lambda: None)
    channel.answer('{"do": "interlock", "open": ["GUARD", "FAN"]}')
    channel.answer('{"do": "step", "scans": 2}')
    # GUARD is bit 1, FAN bit 2 of the six
    assert shown(emulator).interlock == 0b111001
    assert json.loads(channel.answer('{"do": "status"}'))["ok"]["state"] == "FAULT"


# --- values that exceed their register, and steps that did not converge -------------------------


@pytest.fixture(params=["bench_int16", "bench_float32"])
def spiking(request):
    """An emulator of a bench without physics, and the bench. Its `push` is added to its speed."""
    bench = LinearBench()
    plc = Plc(bench, load(request.param), backlash=BACKLASH)
    made = Emulator(plc, PlcServer(plc.register_map, "127.0.0.1", 0))
    made.scan()
    return made, bench


def raw(emulator: Emulator, signal: str) -> bytes:
    register_map = emulator.server.register_map
    register = register_map.register(signal)
    assert register is not None
    first = register.address - register_map.measurement.start
    words = emulator.server.image[first : first + register.raw.words]
    return b"".join(word.to_bytes(2, "big") for word in words)


@pytest.mark.parametrize("push", [1e6, -1e6])
def test_spike_that_its_register_cannot_hold_is_shown_as_not_available(spiking, push):
    """An int16 shows 0x8000. A float32 holds the value, so its reader must judge it."""
    emulator, bench = spiking
    bench.push = push
    emulator.scan()
    if emulator.server.register_map.name == "bench_int16":
        assert raw(emulator, "motor_speed") == b"\x80\x00"
        assert raw(emulator, "drum_speed") == b"\x80\x00"
    else:
        (shown_speed,) = struct.unpack(">f", raw(emulator, "motor_speed"))
        assert abs(shown_speed) > 1e5
        assert (shown_speed > 0) == (push > 0)


def test_what_fits_is_shown_beside_a_spike_and_the_next_scan_is_whole_again(spiking):
    emulator, bench = spiking
    bench.push = 1e6
    emulator.scan()
    beside = raw(emulator, "armature_current")
    assert raw(emulator, "plc_heartbeat") == (2).to_bytes(2, "big")
    bench.push = 0.0
    emulator.scan()
    measurement = shown(emulator)
    assert measurement.motor_speed == 0.0
    assert measurement.armature_current == pytest.approx(10.0)
    assert raw(emulator, "armature_current") == beside


def test_register_without_a_mark_stays_at_its_end():
    register_map = load("bench_int16")
    registers = tuple(replace(one, not_available=None) for one in register_map.registers)
    unmarked = replace(register_map, registers=registers)
    speed = unmarked.register("motor_speed")
    assert speed is not None
    measurement = Measurement(
        sequence_start=1, plc_heartbeat=1, plc_time=0.0, status=Status(0), sequence_end=1,
        motor_speed=1e6, drum_speed=-1e6, shaft_torque=0.0, **OPTIONAL,
    )  # fmt: skip
    words = encode(unmarked, measurement)
    drum = unmarked.register("drum_speed")
    assert drum is not None
    assert words[speed.address] == 0x7FFF
    assert words[drum.address] == 0x8000


OPTIONAL = {
    "plc_state": PlcState.READY, "alarm": Alarm(0), "alarm_reserved": 0, "shaft_torque_mean": 0.0,
    "armature_current": 0.0, "armature_voltage": 0.0, "speed_reference": 0.0,
    "shell_temperature_1": 300.0, "shell_temperature_2": 300.0, "field_current": 0.0,
    "shaft_torque_integral": 0.0, "drum_count": 0, "motor_count": 0, "command_sequence_echo": 0,
    "command_age": 0.0, "scan_time_max": 0.0, "interlock": CLOSED,
}  # fmt: skip


def test_status_counts_steps_of_the_bench_that_did_not_converge(spiking):
    emulator, bench = spiking
    channel = ControlChannel(emulator, None, lambda: None)
    assert json.loads(channel.answer('{"do": "status"}'))["ok"]["unsettled"] == 0
    assert unsettled_text(emulator) == ""
    bench.unsettled = 3
    assert "3 IMPLICIT STAGES" in unsettled_text(emulator)
    assert json.loads(channel.answer('{"do": "status"}'))["ok"]["unsettled"] == 3
