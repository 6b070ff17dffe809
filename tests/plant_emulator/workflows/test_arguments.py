"""Wrong arguments of the library are told in one line, before any work."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plant_emulator as pe

LOG = Path(__file__).parents[2] / "data" / "bench_nominal" / "program1.csv.gz"
LAME = pe.Log(np.arange(3.0), {"motor_speed": np.zeros(3)})
LAG, SIZE = "torque_sensor_lag", "time_constant"


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: pe.diagnose(LOG, model="x"), "model='x'"),
        (lambda: pe.diagnose(LOG, workers=0), "workers=0"),
        (lambda: pe.simulate(LOG, reference="x"), "reference='x'"),
        (lambda: pe.simulate("program1", start="x"), "start='x'"),
        (lambda: pe.simulate("program1", seed=-1), "seed=-1"),
        (lambda: pe.simulate(3), "3: a log, a program"),
        (lambda: pe.validate(LOG, start="x"), "start='x'"),
        (lambda: pe.identify(LOG, reference="x"), "reference='x'"),
        (lambda: pe.detectability(LOG, reference="x"), "reference='x'"),
        (lambda: pe.identify(LOG, free="inertia"), "free inertia: no parameter of the bench"),
        (lambda: pe.diagnose(LOG, without="stribek"), "without stribek: no effect of that name"),
        (lambda: pe.simulate("program1", effects=None), "effects=None"),  # type: ignore[arg-type]
        (lambda: pe.simulate("program1", effects={LAG: None}), f"effect {LAG}: None"),  # type: ignore[dict-item]
        (lambda: pe.simulate("program1", effects={LAG: {SIZE: None}}), f"{SIZE}=None"),  # type: ignore[dict-item]
        (lambda: pe.simulate("program1", effects={LAG: {SIZE: "x"}}), f"{SIZE}='x'"),  # type: ignore[dict-item]
        (lambda: pe.simulate("program1", effects=f"{LAG}:{SIZE}=x"), f"{SIZE}='x'"),
        (lambda: pe.simulate(LAME), "log: no speed_reference"),
        (lambda: pe.identify(LAME), "log: no speed_reference, drum_speed, shaft_torque"),
        (lambda: pe.identify_truck("a.csv", "b.csv", mass=3640.0), "a.csv: no such file"),
    ],
)
def test_wrong_argument_is_named_with_its_value(call: Callable[[], Any], argument: str) -> None:
    with pytest.raises(pe.InputError) as error:
        call()
    assert argument in str(error.value)
    assert "--" not in str(error.value)  # an option belongs to a command


@pytest.mark.parametrize("analysis", [pe.validate, pe.identify, pe.diagnose, pe.detectability])
def test_analysis_without_any_log_is_refused(analysis: Callable[[list[str]], Any]) -> None:
    with pytest.raises(pe.InputError, match="no log is given"):
        analysis([])


def test_a_single_path_counts_as_a_list_of_one() -> None:
    assert pe.validate(str(LOG)).to_json() == pe.validate([str(LOG)]).to_json()


def test_a_log_that_is_given_twice_stands_twice_in_the_answer() -> None:
    answer = pe.validate([LOG, LOG]).to_json()
    assert list(answer["logs"]) == [str(LOG), f"{LOG} (2)"]
    assert answer["logs"][f"{LOG} (2)"] == answer["logs"][str(LOG)]


def test_a_missing_folder_is_an_input_error_with_the_file(tmp_path: Path) -> None:
    log, absent = pe.read_log(LOG), tmp_path / "absent"
    for write in (
        lambda: pe.write_log(log, absent / "run.csv"),
        lambda: pe.validate(log).plot(absent / "fit.png"),
        lambda: pe.save_parameters(pe.load_parameters(), absent / "mine.toml"),
    ):
        with pytest.raises(pe.InputError, match=r"absent.*No such file or directory; a file that"):
            write()


def test_an_unknown_signal_is_told_with_those_of_the_log() -> None:
    with pytest.raises(KeyError, match=r"no signal 'torque'; known: .*shaft_torque"):
        pe.read_log(LOG)["torque"]


def test_an_unknown_parameter_is_told_with_those_of_the_set() -> None:
    with pytest.raises(KeyError, match=r"no parameter 'drum'; known: .*drum_inertia"):
        pe.load_parameters().value("drum")
