"""`identify` and `validate` as calls from Python."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

import plant_emulator as pe
from plant_emulator.cli import main
from plant_emulator.errors import LogError
from plant_emulator.signals.log import Log

CASE = Path(__file__).parents[2] / "data" / "bench_nominal"
RUNS = [CASE / f"program{k}.csv.gz" for k in (1, 2)]
Reader = Callable[[str], Log]


@pytest.fixture(scope="module")
def found() -> pe.IdentificationResult:
    """The drum's inertia, from one file, with another one held out."""
    return pe.identify([RUNS[0]], free=["drum_inertia"], hold_out=[RUNS[1]])


def as_json(*arguments: str | Path) -> dict[str, object]:
    """What the command answers, but for its processor time."""
    result = CliRunner().invoke(main, [*map(str, arguments), "--json", "-"])
    assert result.exit_code == 0, result.output
    answer: dict[str, object] = json.loads(result.stdout)
    answer.pop("cpu_seconds", None)
    return answer


def test_library_and_command_identify_alike(found: pe.IdentificationResult) -> None:
    answer = found.to_json()
    assert answer.pop("cpu_seconds") > 0.0
    assert answer == as_json("identify", RUNS[0], "--free", "drum_inertia", "--hold-out", RUNS[1])


def test_inertia_of_the_independent_bench_is_in_the_record(found: pe.IdentificationResult) -> None:
    (inertia,) = found.parameters
    assert inertia.value == pytest.approx(312.69, rel=1e-3)  # tests/data/README.md
    assert found.parameter_set.value("drum_inertia") == inertia.value
    assert found.parameter_set["drum_inertia"].standard_error == inertia.standard_error
    assert [one.source for one in found.held_out] == [str(RUNS[1])]
    assert found.converged
    assert repr(found).startswith(
        "<IdentificationResult: 1 of 1 parameters determined by 1 logs; residual "
    )


def test_logs_that_were_read_are_fitted_as_their_files(found: pe.IdentificationResult) -> None:
    again = pe.identify([pe.read_log(RUNS[0])], free=["drum_inertia"])
    assert again.parameters == found.parameters
    assert again.fitted[0].fits == found.fitted[0].fits
    (origin,) = again.parameter_set.origin["logs"]
    assert origin.startswith(f"{RUNS[0]} sha256:")


def test_same_log_twice_is_refused() -> None:
    log = pe.read_log(RUNS[0])
    with pytest.raises(LogError, match="the same run as"):
        pe.identify([log], hold_out=[log])


def test_library_and_command_validate_alike() -> None:
    found = pe.validate([RUNS[0], pe.read_log(RUNS[1])], cutoff=5.0)
    assert found.to_json() == as_json("validate", *RUNS, "--filter", "5")
    lowest = min(fit.val1 for one in found.comparisons for fit in one.fits.values())
    assert f"2 logs; Val1 from {lowest:.2f} to " in repr(found)
    assert str(found).splitlines()[0] == str(RUNS[0])


def test_simulation_of_a_parameter_set_validates_it_perfectly() -> None:
    log = pe.simulate("program1")
    (one,) = pe.validate([log], start="middle").comparisons
    assert {fit.val1 for fit in one.fits.values()} == {100.0}
