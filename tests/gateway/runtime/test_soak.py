"""A short soak: run after run, nothing grows; and every counter wraps in a run that goes on.

`tests/gateway/soak.py` is the long one.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gateway.cycle.record import NOTHING
from gateway.cycle.supervisor import State
from gateway.link.plc import TcpLink
from gateway.recordings.recording import read
from plant_emulator.emulator.process import EmulatorProcess
from tests.gateway.fault_proxy import proxy
from tests.gateway.peer import Request
from tests.gateway.runtime.test_loop import MAP, Run
from tests.gateway.soak import Soak

pytestmark = pytest.mark.slow

OLD = {
    "sequence_start": -300,
    "sequence_end": -300,
    "plc_heartbeat": -350,
    "plc_time": -40_000,
    "drum_count": -1000,
    "motor_count": -1000,
    "shaft_torque_integral": 2**31 - 200_000,
}
"""Raw counts by which the counters of an old PLC differ: they wrap after 3 to 5 s."""
TRANSACTIONS, BLOCKS = 64_600, 65_300
"""What an old gateway has asked and written. The client counts its requests to 65000."""


def test_run_after_run_leaves_no_file_no_thread_no_lost_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    with EmulatorProcess(speed=None, driver="none") as emulator:
        soak = Soak(emulator, tmp_path)
        first, *others = soak.runs(4, drive=0.5)
    for found in others:
        assert (found.files, found.threads) == (first.files, first.threads)
        assert (found.dropped, found.lost) == (0, first.lost)
        assert found.gateway == pytest.approx(first.gateway, abs=2.0)
    records = read(tmp_path / "soak.rlrec").records
    assert records["tick"].tolist() == list(range(soak.ticks))


def aged(request: Request, reply: bytes) -> bytes:
    """Reading whose counters are those of an old PLC."""
    if request.function != 3:
        return reply
    image = bytearray(reply)
    for signal, shift in OLD.items():
        register = MAP.register(signal)
        assert register is not None
        size = 4 if register.type.endswith("32") else 2
        place = slice(9 + 2 * register.address, 9 + 2 * register.address + size)
        value = (int.from_bytes(image[place], "big") + shift) % 256**size
        image[place] = value.to_bytes(size, "big")
    return bytes(image)


def test_counters_of_both_sides_wrap_in_a_run_that_goes_on(tmp_path: Path) -> None:
    with (
        EmulatorProcess(speed=None, driver="none", truck_mass=3640.0) as emulator,
        proxy(emulator.port) as between,
    ):
        between.toxic = aged
        run = Run(emulator, tmp_path / "run.rlrec")
        run.link.close()
        port = between.listening.port
        run.loop._link = run.link = TcpLink("127.0.0.1", port, unit=1, timeout=1.0)
        state = run.loop._state
        run.loop._state = replace(state, command=replace(state.command, number=BLOCKS))
        run.into(State.ARMED, 100)
        assert run.link._client is not None
        run.link._client.transaction.next_tid = TRANSACTIONS
        emulator.set_remote(on=True)
        run.into(State.RUN, 20)
        run.for_ticks(500)
        assert run.output.state is State.RUN
        assert 0 < run.link._client.transaction.next_tid < 1000
        run.link.close()
    records = run.recording.records[-500:]
    assert set(records["fault"]) == {NOTHING}
    for name in (*(f"measured_{one}" for one in OLD), "setpoint_command_sequence"):
        span = MAP.modulus(name.partition("_")[2])
        assert span is not None
        jumps = np.abs(np.diff(records[name].astype(float))) > span / 2.0
        assert (name, np.count_nonzero(jumps)) == (name, 1)
