"""Every fault of the emulator in RUN, over the real socket: the gateway's reason and how fast.

One gateway meets all of them one after the other: so it also has to come back into RUN after each,
and only by the operator's remote switch.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from gateway.recordings import recording
from plant_emulator.emulator.plc import faults
from plant_emulator.emulator.process import EmulatorProcess
from tests.system.gateway_process import Gateway, gateway, until, until_armed

WITHIN = 0.15
TICK = 0.01
REASONS = {
    "frozen_heartbeat": {"HEARTBEAT_FROZEN"},
    "frozen_image": {"SEQUENCE_FROZEN", "HEARTBEAT_FROZEN"},
    "late_reply": {"TIMEOUT"},
    "nan": {"NOT_AVAILABLE", "OUT_OF_RANGE", "NOT_FINITE"},
    "torn_image": {"TORN_IMAGE"},
    "drop_mid_reply": {"CONNECTION_LOST"},
    "refuse_connection": {"CONNECTION_LOST", "NOT_CONNECTED"},
    "wrong_function": {"WRONG_FUNCTION"},
    "wrong_count": {"WRONG_COUNT"},
    "wrong_transaction": {"WRONG_TRANSACTION"},
    "word_order": {"TEST_WORD"},
    "restart": {"PLC_RESTARTED"},
    **{f"exception_{code}": {f"EXCEPTION_{code}"} for code in range(1, 12)},
}


@dataclass(frozen=True, kw_only=True)
class Met:
    """What the recording says about one fault.

    delay : PLC time from the first faulty sample to the tick that leaves RUN [s]
    """

    delay: float
    reason: str
    next_state: str


def run_again(emulator: EmulatorProcess) -> None:
    """Turn the remote switch off and on until the PLC is in road-load, and stays there."""
    for _ in range(20):
        emulator.set_remote(on=False)
        time.sleep(0.2)
        emulator.set_remote(on=True)
        time.sleep(0.5)
        if emulator.status()["state"] == "ROAD_LOAD":
            return
    raise AssertionError("the gateway does not come back into RUN")


def suffer(emulator: EmulatorProcess, name: str) -> float:
    """Let one fault happen for half a second in RUN; PLC time of the first faulty sample [s]."""
    run_again(emulator)
    start = round(emulator.status()["time"] + 0.1, 2)
    emulator.set_faults(f"{name}@{start}")
    until(lambda: emulator.status()["time"] > start + 0.5)
    emulator.set_faults()
    return start


def met(daemon: Gateway, start: float) -> Met:
    """What came of the fault whose first faulty sample has this PLC time."""
    (path,) = (daemon.folder / "recordings").glob("*.rlrec")
    found = recording.read(path)
    records = found.records
    sample, now = records["measured_plc_time"], records["now"]
    # the clocks of PLC and gateway differ by what the freshest sample shows, to within a tick
    began = start + np.nanmin(now - sample)
    states = np.array([found.state(code) for code in records["state"]])
    before = now < began - TICK
    assert states[before][-1] == "RUN"
    after = np.flatnonzero(~before & (states != "RUN"))[0]
    return Met(
        delay=float(now[after] - began),
        reason=found.reason(records["reason"][after]),
        next_state=str(states[after]),
    )


@pytest.fixture(scope="module")
def armed(tmp_path_factory) -> Iterator[tuple[EmulatorProcess, Gateway]]:
    folder = tmp_path_factory.mktemp("faults")
    with EmulatorProcess(truck_mass=None) as emulator, gateway(folder, emulator.port) as daemon:
        until_armed(emulator)
        yield emulator, daemon


def test_every_fault_has_its_reasons_here():
    assert set(REASONS) == set(faults.NAMES)


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.parametrize("name", faults.NAMES)
def test_fault_ends_the_run_with_its_reason_within_150_ms(armed, name):
    emulator, daemon = armed
    seen = met(daemon, suffer(emulator, name))
    assert seen.reason in REASONS[name]
    assert seen.next_state in ("RAMPDOWN", "SAFE")
    assert seen.delay <= WITHIN
