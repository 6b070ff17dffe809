"""What is noticed of a run of an axis before anything is fitted."""

import re
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.errors import LogError
from plant_emulator.recordings.axis_magnitudes import (
    check_magnitudes,
    counts_degrees,
    magnitude_note,
)
from plant_emulator.recordings.axis_preflight import axis_notes, axis_preflight, held_period
from plant_emulator.signals.axis_log import AxisLog
from tests.plant_emulator.axis_motion import motion

TIME, POSITION, VELOCITY, TORQUE = motion()
LOG = AxisLog(time=TIME, position=POSITION, force=TORQUE, rotary=True, source="run.csv")


def test_a_sound_run_is_not_objected_to() -> None:
    assert axis_preflight(LOG) == []


def test_an_uneven_run_with_a_hole_is_not_objected_to() -> None:
    kept = np.random.default_rng(1).uniform(size=len(TIME)) < 0.7
    kept[600:800] = False
    cut = replace(LOG, time=TIME[kept], position=POSITION[kept], force=TORQUE[kept])
    assert axis_preflight(cut) == []


def test_a_turned_torque_is_refused() -> None:
    with pytest.raises(LogError, match=r"run\.csv: wrong sign: the torque points against"):
        axis_preflight(replace(LOG, force=-TORQUE))


def test_a_turned_position_is_refused() -> None:
    with pytest.raises(LogError, match="wrong sign"):
        axis_preflight(replace(LOG, position=-POSITION))


def test_weight_and_a_load_do_not_look_like_a_wrong_sign() -> None:
    weight, load = 3.0 * np.cos(POSITION), 2.0 * np.sin(0.7 * TIME) + 1.0
    assert axis_preflight(replace(LOG, force=TORQUE + weight)) == []
    assert axis_preflight(replace(LOG, force=TORQUE + weight + load, load=load)) == []


def test_an_axis_that_something_else_drives_is_told_but_not_refused() -> None:
    braked = TORQUE - 0.8 * VELOCITY
    [note] = axis_preflight(replace(LOG, force=braked))
    assert "something else drives the axis" in note


def test_a_load_with_the_other_sign_is_told() -> None:
    load = 5.0 * np.sin(0.7 * TIME)
    [note] = axis_preflight(replace(LOG, force=TORQUE + load, load=-load))
    assert "the load seems to have the wrong sign" in note


@pytest.mark.parametrize(("name", "told"), [("position", "position"), ("force", "torque")])
def test_a_channel_that_never_changes_is_refused(name: str, told: str) -> None:
    frozen = replace(LOG, **{name: np.full(len(TIME), 1.5)})  # type: ignore[arg-type]
    with pytest.raises(LogError, match=rf"the {told} is frozen: it is 1\.5 in all samples"):
        axis_preflight(frozen)


def test_a_position_that_freezes_in_motion_is_refused_with_its_time() -> None:
    fast = 500 + int(np.argmax(np.abs(VELOCITY[500:1000])))
    position = POSITION.copy()
    position[fast:] = position[fast]
    with pytest.raises(LogError, match=rf"frozen: exactly .* from {TIME[fast]:.6g} s to 19\.99 s"):
        axis_preflight(replace(LOG, position=position))


def test_an_axis_that_is_braked_and_rests_is_not_frozen() -> None:
    position = np.round(np.cumsum(np.clip(np.sin(TIME), 0.0, None)) * 0.01, 3)
    torque = 0.05 * np.clip(np.cos(TIME), 0.0, None) + 0.3 * (np.sin(TIME) > 0.0)
    assert axis_preflight(replace(LOG, position=position, force=torque)) == []


def test_a_held_channel_is_told_with_its_period() -> None:
    held = np.repeat(POSITION[::10], 10)
    assert held_period(TIME, held) == pytest.approx(0.1)
    assert held_period(TIME, POSITION) is None
    assert "position is new only every 100 ms" in axis_preflight(replace(LOG, position=held))[0]


def test_a_slow_motion_over_encoder_steps_is_not_held() -> None:
    assert held_period(TIME, np.round(POSITION, 1)) is None


def test_steps_that_divide_360_tell_degrees() -> None:
    step = 2.0 * np.pi / 4096
    steps = np.round(POSITION / step)
    assert not counts_degrees(steps * step)
    assert counts_degrees(steps * 360.0 / 4096)
    assert not counts_degrees(np.round(POSITION, 2))


def test_milliseconds_in_a_column_of_seconds_are_told() -> None:
    slow = replace(LOG, time=TIME * 1e3)
    with pytest.raises(LogError, match=r"a sample every 10 s.* give --column time=COLUMN:ms"):
        check_magnitudes(slow, {})


def test_the_note_has_travel_speed_and_power_and_asks_where_they_are_large() -> None:
    fast = float(np.abs(VELOCITY).max())
    note = magnitude_note([LOG])
    assert f"({float(np.ptp(POSITION)) / 2 / np.pi:.3g} rev)" in note
    assert "?" not in note
    asked = magnitude_note([replace(LOG, position=POSITION * 180.0 / np.pi)])
    assert fast * 180.0 / np.pi < 600.0 or "are the values in deg?" in asked


def test_a_torque_that_may_be_in_millinewtons_is_doubted_until_its_unit_is_named() -> None:
    # A drive of 0.5 W that is logged in mN m has 500 W in N m.
    peak = float(np.max(np.abs(TORQUE * VELOCITY)))
    small = replace(LOG, force=TORQUE * 500.0 / peak)
    note = magnitude_note([small])
    assert "W if the values are in mNm: --column force=COLUMN:Nm or :mNm tells which" in note
    found = re.search(r"with up to ([\d.]+) W, or ([\d.]+) W if", note)
    assert found is not None
    assert [float(v) for v in found.groups()] == pytest.approx([500.0, 0.5], rel=0.1)
    assert "mNm" not in magnitude_note([replace(small, confirmed=frozenset({"force"}))])


def test_unused_columns_are_told_once() -> None:
    other = replace(LOG, other=("temp", "mode"))
    assert axis_notes([other, other])[1:] == ["columns that are not used: temp, mode"]
