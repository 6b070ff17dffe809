"""`plant-emulator diagnose` on logs of the independent bench, as an operator calls it."""

import gzip
import json
import re
from numbers import Real
from pathlib import Path
from typing import Any

import pytest

from tests.system.diagnosis.conftest import (
    FITTED,
    LEFT_OUT,
    LIBRARY,
    PREDICTED,
    Diagnosed,
    plant_emulator,
    without,
)

CHANNELS = {"motor_speed", "drum_speed", "armature_current", "shaft_torque"}
# The answer's form, gap-diagnosis/1: a type, a tuple of what may stand there, [of every entry],
# {of every key}; Real stands for a number.
NAME, NAMES, BY_CHANNEL = str, [str], dict.fromkeys(CHANNELS, Real)
FORM: dict[str, Any] = {
    "schema": NAME,
    "logs": {"estimation": NAMES, "held_out": NAMES},
    "verdict": {
        "kind": NAME, "effects": NAMES, "class": [NAMES],
        "parameters": [{"name": NAME, "nominal": Real, "estimated": Real, "standard_error": Real,
                        "unit": NAME}],
        "confidence": (Real, None), "statement": NAME, "next_experiment": (NAME, None),
        "log_odds": (Real, None),
    },
    "location": {
        "subsystem": (NAME, None), "channel": (NAME, None), "phase": (NAME, None),
        "subsystems": [{"name": NAME, "share": Real}],
        "map": [{"channel": NAME, "phase": NAME, "gap": Real, "noise": Real}],
    },
    "gap": {
        "nominal": BY_CHANNEL, "recalibrated": BY_CHANNEL, "explained": BY_CHANNEL,
        "noise_floor": BY_CHANNEL, "closed_fraction": (Real, None),
        "closed_fraction_ci95": ([Real], None),
    },
    "ranking": [{"effect": NAME, "subsystem": NAME, "evidence": Real,
                 "held_out_gain": (Real, None), "accepted": bool,
                 "parameters": [{"name": NAME, "value": Real, "standard_error": Real,
                                 "unit": NAME}]}],
    "undetectable": [{"effect": NAME, "reason": NAME}],
    "trace": [{"action": NAME, "effects": NAMES, "promised": dict, "gain": Real,
               "mean_square": Real}],
    "noise": [{"channel": NAME, "deviation": Real, "correlation_time": Real, "lines": [Real],
               "outliers": Real, "held_period": Real, "white": bool}],
}  # fmt: skip


def faults(value: Any, form: Any, place: str = "answer") -> list[str]:
    """Places where a value is not of the form."""
    if isinstance(form, tuple):
        return min((faults(value, one, place) for one in form), key=len)
    if isinstance(form, dict) and isinstance(value, dict) and set(value) == set(form):
        return [f for key in form for f in faults(value[key], form[key], f"{place}.{key}")]
    if isinstance(form, list) and isinstance(value, list):
        return [f for k, one in enumerate(value) for f in faults(one, form[0], f"{place}[{k}]")]
    if form is None and value is None:
        return []
    right = isinstance(form, type) and isinstance(value, form)
    right = right and (form is bool or not isinstance(value, bool))
    return [] if right else [f"{place}: {value!r:.80}, not {form!r:.200}"]


def nrmsd(*options: str | Path) -> dict[str, float]:
    """What `validate` tells of the held-out run, by channel."""
    done = plant_emulator("validate", PREDICTED, *options, "--json", "-")
    (found,) = json.loads(done.stdout)["logs"].values()
    return {channel: fit["nrmsd"] for channel, fit in found.items()}


@pytest.mark.slow
def test_answer_has_every_key_with_its_type(diagnosed: Diagnosed) -> None:
    assert faults(diagnosed.answer, FORM) == []
    assert diagnosed.answer["schema"] == "gap-diagnosis/1"
    assert diagnosed.answer["logs"] == {"estimation": FITTED, "held_out": [PREDICTED]}
    # a form that takes anything would show nothing
    assert faults({**diagnosed.answer, "gap": {}, "ranking": [{}]}, FORM) != []


@pytest.mark.slow
def test_hidden_lag_is_found_with_its_size_and_place(diagnosed: Diagnosed) -> None:
    verdict, first = diagnosed.answer["verdict"], diagnosed.answer["ranking"][0]
    assert (verdict["kind"], verdict["effects"]) == ("effect", ["torque_sensor_lag"])
    assert diagnosed.answer["location"]["subsystem"] == "torque_sensor"
    size, shape = first["parameters"]
    # 0.1 s and first order, with which the logs were made; the error holds that of other orders
    assert abs(size["value"] - 0.1) < 0.001 < size["standard_error"] < 0.02
    assert abs(shape["value"]) < 4.0 * shape["standard_error"] < 0.02
    assert diagnosed.answer["gap"]["closed_fraction"] > 0.98
    assert diagnosed.errors == ""


@pytest.mark.slow
def test_terminal_tells_it_on_one_screen(diagnosed: Diagnosed) -> None:
    rows = diagnosed.terminal.splitlines()
    assert len(rows) <= 23
    assert max(map(len, rows)) <= 80
    assert rows[0].startswith("EFFECT FOUND")
    for told in ("torque_sensor_lag", "where    torque sensor", "noise floor", "closed:"):
        assert told in diagnosed.terminal


@pytest.mark.slow
def test_effects_that_were_taken_out_stand_nowhere_in_the_answer(diagnosed: Diagnosed) -> None:
    text = json.dumps({k: v for k, v in diagnosed.answer.items() if k != "logs"})
    assert not [name for name in LEFT_OUT if f'"{name}"' in text]
    assert {entry["effect"] for entry in diagnosed.answer["ranking"]} <= LIBRARY


@pytest.mark.slow
def test_saved_set_predicts_the_held_out_run_to_its_noise(diagnosed: Diagnosed) -> None:
    nominal, saved = nrmsd(), nrmsd("--parameters", diagnosed.saved)
    floor = diagnosed.answer["gap"]["noise_floor"]
    assert all(saved[channel] < nominal[channel] for channel in CHANNELS)
    assert nominal["shaft_torque"] > 5.0 * floor["shaft_torque"]
    assert all(saved[channel] < 1.2 * floor[channel] for channel in CHANNELS)


@pytest.mark.slow
def test_single_log_is_predicted_on_its_later_part_and_its_cause_withheld_is_unknown() -> None:
    left_out = [*LEFT_OUT, "torque_sensor_lag"]
    done = plant_emulator("diagnose", PREDICTED, *without(left_out), "--json", "-")
    answer = json.loads(done.stdout)
    assert faults(answer, FORM) == []
    assert answer["logs"] == {"estimation": [PREDICTED], "held_out": [PREDICTED]}
    assert answer["verdict"]["kind"] == "unknown"
    assert answer["location"]["subsystem"] == "torque_sensor"
    assert answer["gap"]["closed_fraction"] is None


@pytest.mark.slow
def test_own_effect_of_the_readme_is_found_in_the_place_of_the_one_left_out(tmp_path: Path) -> None:
    page = Path(__file__).parents[3] / "plant_emulator" / "diagnosis" / "README.md"
    readme = page.read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?amplifier.*?)```", readme, re.DOTALL)
    own, saved = tmp_path / "amplifier_filter.py", tmp_path / "bench.toml"
    own.write_text(code, encoding="utf-8")
    left_out = [*LEFT_OUT, "torque_sensor_lag", "stribeck"]
    done = plant_emulator(
        "diagnose", *FITTED, "--effects", own, *without(left_out), "--save", saved, "--json", "-"
    )
    answer = json.loads(done.stdout)
    assert answer["verdict"]["effects"] == ["amplifier_filter"]
    (size,) = answer["ranking"][0]["parameters"]
    assert (size["name"], size["unit"]) == ("tau", "s")
    assert abs(size["value"] - 0.1) < 4.0 * size["standard_error"] < 0.004
    assert 'file = "amplifier_filter.py"' in saved.read_text(encoding="utf-8")


@pytest.mark.parametrize("column", ["label", "true_effect", "drift_fg"])
def test_log_with_its_own_answer_is_refused(tmp_path: Path, column: str) -> None:
    head, *rows = gzip.decompress(Path(FITTED[0]).read_bytes()).decode().splitlines()
    told = tmp_path / "told.csv"
    told.write_text("\n".join([f"{head},{column}", *(f"{row},1" for row in rows), ""]))
    done = plant_emulator("diagnose", told, FITTED[1])
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert f"{told}: line 1: column {column}" in line


@pytest.mark.parametrize("model", ["bench", "axis"])
def test_effect_to_leave_out_that_there_is_not_is_refused(tmp_path: Path, model: str) -> None:
    logs = FITTED
    if model == "axis":
        logs = [str(tmp_path / f"run{k}.csv") for k in (1, 2)]
        for k, path in enumerate(logs):
            rows = [f"{0.001 * n:.3f},{0.01 * n},{k}" for n in range(100)]
            Path(path).write_text("\n".join(["time_s,position_m,force_N", *rows, ""]))
    done = plant_emulator("diagnose", "--model", model, *logs, "--without", "stribek")
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert "--without stribek" in line
    assert "stribeck" in line
