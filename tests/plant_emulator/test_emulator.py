"""The emulator put together: the real bench under the PLC, stepped without a clock."""

import json
from math import pi

import numpy as np
import pytest

from plant_emulator import logs
from plant_emulator.control import Control as Channel
from plant_emulator.emulator import Emulator, Options, build
from plant_emulator.faults import FaultError
from register_maps.codec import decode_measurement, encode_setpoint
from register_maps.register_map import MapError
from register_maps.signals import Alarm, Control, Measurement, Mode, PlcState, Setpoint, Status

RPM = 2 * pi / 60


def shown(emulator: Emulator) -> Measurement:
    return decode_measurement(emulator.server.register_map, emulator.server.image)


def drive(emulator: Emulator, scans: int, speed: float = 0.0, *, enable: bool = True) -> None:
    """Ask for a speed [rad/s] before each of so many scans."""
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
    """Nobody on the drum, remote."""
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
    # the drum has no friction and floats slowly through its gap
    assert measurement.drum_speed == pytest.approx(4025 * RPM / 62.6, abs=0.05)
    assert measurement.shaft_torque_mean == pytest.approx(-13.4, abs=0.1)
    assert measurement.armature_current == pytest.approx(15.7, abs=0.2)


def test_integral_of_the_torque_is_the_sum_of_the_means(emulator):
    means = []
    emulator.scan()
    for _ in range(50):
        drive(emulator, 1, 500 * RPM)
        means.append(shown(emulator).shaft_torque_mean)
    # each mean is rounded to 0.01 Nm
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
    # the driver starts after 2 s
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
    # 1000 rpm/s from the second scan on: at that moment still 0, 10 ms later 10 rpm
    emulator.scan()
    drive(emulator, 3, 300 * RPM)
    assert np.allclose(emulator.log()["speed_reference"] / RPM, [0.0, 0.0, 10.0, 20.0])


def test_reference_with_a_truck_is_logged_as_a_staircase():
    emulator = build(Options(truck_mass=3640.0, remote=True, keeps_log=True))
    emulator.scan()
    drive(emulator, 3, 300 * RPM)
    # mean over the next 10 ms of a ramp in ten steps: 5.5, 15.5, 25.5
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
    channel = Channel(emulator, None, lambda: None)
    channel.answer('{"do": "faults", "names": ["frozen_image"]}')
    channel.answer('{"do": "step", "scans": 5}')
    assert shown(emulator).sequence_start == 1
    channel.answer('{"do": "faults", "names": []}')
    channel.answer('{"do": "step", "scans": 1}')
    assert shown(emulator).sequence_start == 7


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
    answer = json.loads(Channel(emulator, None, lambda: None).answer(line))
    assert what in answer["error"]
    assert emulator.switches == before


def test_interlocks_open_and_close_on_request(emulator):
    channel = Channel(emulator, None, lambda: None)
    channel.answer('{"do": "interlock", "open": ["GUARD", "FAN"]}')
    channel.answer('{"do": "step", "scans": 2}')
    # GUARD is bit 1, FAN bit 2 of the six
    assert shown(emulator).interlock == 0b111001
    assert json.loads(channel.answer('{"do": "status"}'))["ok"]["state"] == "FAULT"
