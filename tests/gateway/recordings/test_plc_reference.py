"""The reference of a recording is what the PLC did, also where the gateway read no sample."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import register_maps
from gateway.cli import main
from gateway.configuration.config import Config
from gateway.cycle.record import NOTHING, Layout, Tick
from gateway.cycle.supervisor import State
from gateway.recordings import log, recording
from gateway.recordings.header import Header
from gateway.recordings.log import Log
from gateway.recordings.plc_reference import (
    NO_COMMANDS,
    Followed,
    Samples,
    commands,
    knees_of,
    path_between,
)
from register_maps.signals import Control, Measurement, Mode, Setpoint, Status

MAP = register_maps.load("bench_int16")
RATE, SLEW = 100.0, 500.0


def asked(number: int) -> float:
    """Speed of a command [rad/s]: 100 rad/s^2 and a step to and fro."""
    return number + 2.0 * (number % 3)


def driven(path: Path, samples: Sequence[int], name: str) -> Log:
    """Export of a recording whose ticks read these samples and write a command each.

    By hand: at scan k the PLC takes command k - 1, and goes to its line by 5 rad/s at most.
    """
    told = [0.0]
    for scan in range(1, len(samples)):
        wanted = asked(scan - 1) + RATE * 0.01
        told.append(told[-1] + float(np.clip(wanted - told[-1], -SLEW * 0.01, SLEW * 0.01)))
    layout = Layout.of(MAP)
    head = Header.of(Config(), MAP, started=100.0, shadow=False, real_time="no")
    rows = [layout.pack(_tick(k, sample, told[sample])) for k, sample in enumerate(samples)]
    (path / f"{name}.rlrec").write_bytes(head.encode() + b"".join(rows))
    words = ["export", str(path / f"{name}.rlrec"), "--to", str(path / f"{name}.csv")]
    assert CliRunner().invoke(main, words).exit_code == 0
    return log.read(path / f"{name}.csv")


def _tick(number: int, sample: int, told: float) -> Tick:
    measured = Measurement(
        sequence_start=sample, sequence_end=sample, plc_heartbeat=sample, plc_time=0.01 * sample,
        status=Status.READY, motor_speed=0.0, drum_speed=0.0, shaft_torque=-2.0,
        speed_reference=told, command_sequence_echo=max(0, sample - 1), command_age=0.0,
    )  # fmt: skip
    command = Setpoint(
        command_sequence=number, gateway_heartbeat=number, control=Control(0), mode=Mode.SPEED,
        speed_setpoint=asked(number), speed_rate=RATE, ramp_limit=SLEW,
    )  # fmt: skip
    return Tick(
        tick=number, now=100.0 + 0.01 * number, period=0.01, lateness=0.0, latency=0.001, age=0.0,
        demand=None, missed=0, overruns=0, dropped=0, fault=NOTHING, reason=NOTHING,
        state=State.RUN, shadow=False, stop_requested=False, written=True,
        words_read=[0] * MAP.measurement.count, words_written=[0] * MAP.command.count,
        measurement=measured, setpoint=command,
    )  # fmt: skip


def polyline(found: Log) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a log's reference with its knees, in the order of time."""
    columns = {name: values for name, values in found.columns.items() if "reference" in name}
    nodes = [(found.time, columns["speed_reference"])]
    for knee in ("reference_knee", "reference_knee_2", "reference_knee_3"):
        if knee in columns:
            there = columns[f"{knee}_time"] > 0.0
            nodes.append(((found.time + columns[f"{knee}_time"])[there], columns[knee][there]))
    time, value = (np.concatenate(parts) for parts in zip(*nodes, strict=True))
    order = np.argsort(time, kind="stable")
    return time[order], value[order]


@pytest.mark.parametrize("piece", [1000, 8, 7, 6])
def test_reference_of_lost_scans_is_that_of_a_gateway_that_read_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, piece: int
) -> None:
    """Ticks 7, 12 and 13 read the sample before theirs again, in pieces that begin around 7.

    Of two lost scans in a row nobody knows which command the PLC had.
    """
    monkeypatch.setattr(recording, "PIECE", piece)
    whole = driven(tmp_path, list(range(20)), "whole")
    lossy = driven(tmp_path, [*range(7), 6, *range(8, 12), 11, 11, *range(14, 20)], "lossy")
    assert lossy.time == pytest.approx(np.delete(whole.time, [7, 12, 13]))
    known = np.flatnonzero(lossy.time != lossy.time[11])  # behind the two scans
    expected = np.delete(whole.columns["speed_reference"], [7, 12, 13])
    assert lossy.columns["speed_reference"][known] == pytest.approx(expected[known], abs=1e-4)
    moments = np.arange(0.0, 0.1, 5e-4)
    drawn = np.interp(moments, *polyline(lossy))
    assert drawn == pytest.approx(np.interp(moments, *polyline(whole)), abs=1e-3)


def test_knee_is_where_the_reference_meets_the_line_of_the_command() -> None:
    """From 5 rad/s at 300 rad/s^2.

    To a constant 6 within 1 / 300 s. To the line 6 + 100 t, which is at 7 after the scan, within
    5 ms. To 8, the whole scan.
    """
    begin, told = np.array([5.0, 5.0, 5.0]), np.array([6.0, 7.0, 8.0])
    rate, slew = np.array([0.0, 100.0, 0.0]), np.full(3, 300.0)
    after, value = knees_of(begin, told, rate, slew)
    assert after == pytest.approx([1.0 / 300.0, 0.005, 0.01])
    assert value == pytest.approx([6.0, 6.5, 8.0])


def test_command_that_the_plc_follows_is_the_one_whose_number_it_tells() -> None:
    """The PLC has command 7 at tick 2, still 7 at tick 3, then 9; at tick 0 it tells nothing."""
    fields = [
        *("setpoint_speed_setpoint", "setpoint_speed_rate", "setpoint_ramp_limit"),
        *("setpoint_command_sequence", "measured_command_sequence_echo"),
    ]
    rows = [
        (1, 10, 300, 6, np.nan),
        (2, 20, 300, 7, 6),
        (3, 30, 300, 8, 7),
        (4, 40, 300, 9, 7),
        (5, 50, 300, 10, 9),
    ]
    records = np.array([(*row,) for row in rows], dtype=[(name, float) for name in fields])
    followed, last = commands(records[:3], NO_COMMANDS)
    assert followed.now[1] == pytest.approx([np.nan, 10.0, 20.0], nan_ok=True)
    followed, _ = commands(records[3:], last)
    assert followed.now == pytest.approx(np.array([[2, 4], [20, 40], [300, 300], [7, 9]]))
    assert followed.before == pytest.approx(np.array([[1, 3], [10, 30], [300, 300], [6, 8]]))


@pytest.mark.parametrize(
    ("number", "age", "lost", "knee"),
    [
        # command 8 reached the PLC in the lost scan: 2 + 0.5 at its end, at once on its line
        (9.0, 0.0, 2.5, (0.0, 2.0)),
        # command 7 stayed in force: 1 + 100 (0.01 + 0.01)
        (8.0, 0.0, 3.0, (0.0, 2.0)),
        # command 8 was taken in the lost scan already: a jump by 4 to 6 + 100 0.01 at 500 rad/s^2
        (8.0, 0.01, 7.0, (0.01, 7.0)),
    ],
)
def test_reference_of_a_scan_without_a_sample_follows_the_command_that_the_plc_had(
    number: float, age: float, lost: float, knee: tuple[float, float]
) -> None:
    """The PLC says 2 rad/s for 10 ms after a sample; the next sample comes 20 ms after it."""
    seven, eight, line = (1.0, 100.0, 500.0, 7.0), (2.0, 50.0, 500.0, 8.0), (6.0, 100.0, 500.0, 8.0)
    own, older = {
        (9.0, 0.0): ((3.0, 100.0, 500.0, 9.0), eight),
        (8.0, 0.0): ((3.0, 100.0, 500.0, 8.0), seven),
        (8.0, 0.01): (line, seven),
    }[number, age]
    told = own[0] + own[1] * (age + 0.01)
    begin, knees, _ = path_between(
        before=Samples(np.array([7.0, 7.0]), np.array([0.0, 0.0]), np.array([0.0, 2.0])),
        after=Samples(np.array([7.0, number]), np.array([0.0, age]), np.array([2.0, told])),
        followed=Followed(
            *(np.array(pair).T for pair in ((seven, own), (seven, older), (seven, seven)))
        ),
        steps=np.array([0.01, 0.02]),
    )
    assert begin == pytest.approx([0.0, lost])
    assert knees[2:, 0] == pytest.approx([0.01, 2.0, 0.01 + knee[0], knee[1]])
    assert knees[2:, 1] == pytest.approx(np.zeros(4))


@pytest.mark.parametrize(
    ("written", "number", "told", "middle"),
    [
        # the PLC tells 9 rad/s, which no command of 500 rad/s^2 reaches from 2 within two scans
        ([(1.0, 100.0, 500.0, 7.0)] * 3, 7.0, 9.0, 5.5),
        # command 9 may have overwritten command 8, or command 10 command 9, before the PLC took it
        (
            [(2.5, 0.0, 500.0, 8.0), (6.0, 0.0, 500.0, 9.0), (6.5, 0.0, 500.0, 10.0)],
            10.0,
            6.5,
            4.25,
        ),
    ],
    ids=["another law", "overwritten command"],
)
def test_reference_of_a_scan_that_nobody_knows_is_a_line(
    written: list[tuple[float, ...]], number: float, told: float, middle: float
) -> None:
    """Before, the PLC tells command 7 and 2 rad/s."""
    earlier, before, now = (np.array([command]).T for command in written)
    begin, knees, _ = path_between(
        before=Samples(np.array([7.0]), np.array([0.0]), np.array([2.0])),
        after=Samples(np.array([number]), np.array([0.0]), np.array([told])),
        followed=Followed(now, before, earlier),
        steps=np.array([0.02]),
    )
    assert begin == pytest.approx([middle])
    assert knees[2:] == pytest.approx(np.zeros((4, 1)))
