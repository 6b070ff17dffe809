"""The gateway dies in RUN without a word: what the PLC does, and what is left on the disk."""

import signal

import pytest

from plant_emulator.emulator.process import EmulatorProcess
from tests.system.gateway_process import gateway, until, until_armed

pytestmark = [pytest.mark.slow, pytest.mark.realtime]

WATCHDOG = 0.2
SCAN = 0.01


def test_plc_ramps_the_drum_down_after_sigkill_and_the_recording_is_readable(tmp_path):
    with EmulatorProcess(driver="pi") as emulator, gateway(tmp_path, emulator.port) as daemon:
        until_armed(emulator)
        emulator.set_remote(on=True)
        # the driver accelerates from 2 s on
        until(lambda: emulator.status()["motor_speed"] > 100.0)
        assert daemon.stop(signal.SIGKILL) == -signal.SIGKILL
        killed = emulator.status()
        until(lambda: emulator.status()["state"] == "READY")
        ended = emulator.status()
        log = emulator.log()
    assert ended["alarms"] == ["COMMUNICATION"]
    after = log.time > killed["time"]
    time, reference = log.time[after], log["speed_reference"][after]
    falling = time[1:][reference[1:] < reference[:-1] - 1e-9]
    # the last command was at most one period old when the gateway died; the setpoint may hold its
    # slope for 0.1 s more, then the watchdog bites
    assert falling[0] <= killed["time"] + WATCHDOG + 4 * SCAN
    # the ramp-down is linear at the limit of the last command and ends at rest
    slope = (reference[:-1] - reference[1:]).max() / SCAN
    assert falling[-1] - falling[0] <= reference.max() / slope + 4 * SCAN
    assert abs(log["drum_speed"][-1]) < 0.05
    rows = daemon.rows()
    assert rows[-1]["state"] == "RUN"
    assert float(rows[-1]["motor_speed_rad_s"]) > 90.0
