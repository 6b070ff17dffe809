"""Wrong arguments of the library are told in one line, before any work."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import plant_emulator as pe

LOG = Path(__file__).parents[2] / "data" / "bench_nominal" / "program1.csv.gz"


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
        (lambda: pe.identify_truck("a.csv", "b.csv", mass=3640.0), "a.csv: no such file"),
    ],
)
def test_wrong_argument_is_named_with_its_value(call: Callable[[], Any], argument: str) -> None:
    with pytest.raises(pe.InputError) as error:
        call()
    assert argument in str(error.value)


@pytest.mark.parametrize("analysis", [pe.validate, pe.identify, pe.diagnose, pe.detectability])
def test_analysis_without_any_log_is_refused(analysis: Callable[[list[str]], Any]) -> None:
    with pytest.raises(pe.InputError, match="no log is given"):
        analysis([])


def test_a_single_path_counts_as_a_list_of_one() -> None:
    assert pe.validate(str(LOG)).to_json() == pe.validate([str(LOG)]).to_json()
