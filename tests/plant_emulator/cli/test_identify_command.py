"""The command identify, as a test engineer calls it."""

import csv
import gzip
import json
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from plant_emulator import logs, parameter_sets
from plant_emulator.cli import main
from plant_emulator.errors import UnsettledError
from plant_emulator.estimation import least_squares
from plant_emulator.identification import experiment_design
from plant_emulator.signals.log import Log

DATA = Path(__file__).parents[2] / "data"
CASE = DATA / "bench_practice" / "practice_008"
RUNS = [str(CASE / f"program{k}.csv.gz") for k in (1, 2, 3)]
NOMINAL = [str(DATA / "bench_nominal" / f"program{k}.csv.gz") for k in (1, 2)]
Command = Callable[..., Result]


@pytest.fixture
def identify() -> Command:
    """Return a function: arguments -> the finished call of plant-emulator identify."""
    return lambda *arguments: CliRunner().invoke(main, ["identify", *map(str, arguments)])


def refusal(result: Result) -> str:
    """The one line of a refusal."""
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.splitlines()
    return line.removeprefix("error: ")


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    """A fit with all of its files, and the folder that they are in."""
    folder = tmp_path_factory.mktemp("fit")
    files = {"--save": "set.toml", "--json": "a.json", "--table": "a.csv", "--plot": "a.png"}
    arguments = [RUNS[0], "--hold-out", RUNS[1]]
    arguments += [str(part) for key, name in files.items() for part in (key, folder / name)]
    return folder, CliRunner().invoke(main, ["identify", *arguments])


@pytest.mark.slow
def test_answer_has_the_keys_of_its_schema(fitted: tuple[Path, Result]) -> None:
    folder, result = fitted
    assert result.exit_code == 0, result.output
    answer = json.loads((folder / "a.json").read_text())
    assert answer["schema"] == "identification/1"
    assert answer.keys() >= {
        "parameters", "condition_number", "estimation", "held_out", "simulations", "cpu_seconds",
        "converged",
    }  # fmt: skip
    for parameter in answer["parameters"]:
        assert parameter.keys() == {
            "name", "value", "standard_error", "unit", "identifiable", "nominal"
        }  # fmt: skip
    assert list(answer["estimation"]) == [RUNS[0]]
    assert answer["held_out"][RUNS[1]]["motor_speed"].keys() == {"val1", "val2", "nrmsd"}
    assert answer["converged"] is True


@pytest.mark.slow
def test_person_reads_values_errors_and_what_is_not_determined(
    fitted: tuple[Path, Result],
) -> None:
    _, result = fitted
    lines = result.stdout.splitlines()
    assert any(line.startswith("drum_inertia") and "kg m^2" in line for line in lines)
    assert any(
        line.startswith("flux_constant_2") and line.endswith("NOT DETERMINED by these logs")
        for line in lines
    )
    assert any("flux_constant_2: program" in line for line in lines)
    assert f"{RUNS[1]} (held out)" in lines
    assert max(len(line) for line in lines if "/" not in line) <= 100


@pytest.mark.slow
def test_saved_set_says_where_it_comes_from_and_predicts_as_the_fit_did(
    fitted: tuple[Path, Result],
) -> None:
    folder, _ = fitted
    table = tomllib.loads((folder / "set.toml").read_text())
    assert table["origin"]["logs"][0].startswith(f"{RUNS[0]} sha256:")
    assert table["origin"]["not_determined"] == ["flux_constant_2"]
    assert table["drum_inertia"]["standard_error"] > 0
    validated = CliRunner().invoke(
        main, ["validate", RUNS[1], "--parameters", str(folder / "set.toml"), "--json", "-"]
    )
    again = json.loads(validated.stdout)["logs"][RUNS[1]]
    before = json.loads((folder / "a.json").read_text())["held_out"][RUNS[1]]
    for channel, fit in before.items():
        assert again[channel]["val1"] == pytest.approx(fit["val1"], abs=1e-5), channel


@pytest.mark.slow
def test_table_is_read_by_a_spreadsheet(fitted: tuple[Path, Result]) -> None:
    folder, _ = fitted
    rows = list(csv.DictReader((folder / "a.csv").read_text().splitlines()))
    inertia = next(row for row in rows if row["parameter"] == "drum_inertia")
    assert float(inertia["value"]) == pytest.approx(312.69 * 1.08, rel=0.01)
    assert inertia["unit"] == "kg m^2"


@pytest.mark.slow
def test_plot_is_a_picture(fitted: tuple[Path, Result]) -> None:
    folder, _ = fitted
    assert (folder / "a.png").read_bytes().startswith(b"\x89PNG")


def test_json_on_standard_output_stands_alone(identify: Command) -> None:
    result = identify(NOMINAL[0], "--free", "drum_inertia", "--json", "-")
    answer = json.loads(result.stdout)
    assert [p["name"] for p in answer["parameters"]] == ["drum_inertia"]
    assert answer["parameters"][0]["value"] == pytest.approx(312.69, rel=1e-3)


def test_same_run_twice_is_refused(identify: Command, tmp_path: Path) -> None:
    copy = tmp_path / "copy.csv.gz"
    copy.write_bytes(Path(NOMINAL[0]).read_bytes())
    assert refusal(identify(NOMINAL[0], "--hold-out", copy)) == (
        f"{copy}: the same run as {NOMINAL[0]}; give every run once"
    )


def test_same_run_in_another_form_is_refused(identify: Command, tmp_path: Path) -> None:
    plain = tmp_path / "plain.csv"
    plain.write_bytes(gzip.decompress(Path(NOMINAL[0]).read_bytes()))
    assert refusal(identify(NOMINAL[0], "--hold-out", plain)) == (
        f"{plain}: the same run as {NOMINAL[0]}; give every run once"
    )


def test_fit_is_answered_where_no_program_can_give_advice(
    identify: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Values at which the drive programs cannot be simulated are no reason to lose the fit."""

    def unsettled(*_: object, **__: object) -> None:
        raise UnsettledError("program3: 1 implicit stages did not settle")

    monkeypatch.setattr(experiment_design, "simulate", unsettled)
    result = identify(RUNS[0], "--json", "-")
    assert result.exit_code == 0
    answer = json.loads(result.stdout)
    assert answer["experiments"] == []
    assert not all(p["identifiable"] for p in answer["parameters"])


def test_unknown_parameter_is_refused(identify: Command) -> None:
    assert refusal(identify(NOMINAL[0], "--free", "mass")).startswith("--free mass: no parameter")


def test_missing_file_is_refused(identify: Command) -> None:
    assert refusal(identify("nowhere.csv")).startswith("nowhere.csv: no such file")


def test_torque_of_the_wrong_sign_is_refused(identify: Command, tmp_path: Path) -> None:
    log = logs.read(NOMINAL[0])
    flipped = tmp_path / "flipped.csv"
    logs.write(
        Log(log.time, {**log.signals, "shaft_torque": -log["shaft_torque"]}, "flipped"), flipped
    )
    assert "it must be negative there: change its sign" in refusal(identify(flipped))


def test_what_is_left_out_is_told(identify: Command, tmp_path: Path) -> None:
    log = logs.read(RUNS[0])
    current = log["armature_current"].copy()
    current[500:560] = current[500]
    frozen = tmp_path / "frozen.csv"
    logs.write(Log(log.time, {**log.signals, "armature_current": current}, "frozen"), frozen)
    result = identify(frozen, "--free", "drum_inertia")
    assert result.exit_code == 0
    assert "armature_current_A stands still, first at 5.010 s; 3.2 % is left out" in result.stderr


@pytest.mark.slow
def test_fit_that_does_not_converge_says_so_and_fails(
    identify: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(least_squares, "MAX_ITERATIONS", 1)
    result = identify(RUNS[0], "--json", tmp_path / "a.json")
    assert result.exit_code == 1
    assert "the fit did not converge" in result.stderr
    assert json.loads((tmp_path / "a.json").read_text())["converged"] is False


def test_set_of_a_foreign_origin_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "set.toml"
    path.write_text(parameter_sets.text(parameter_sets.load()) + '\norigin = "somewhere"\n')
    result = CliRunner().invoke(main, ["identify", RUNS[0], "--parameters", str(path)])
    assert result.exit_code == 2


def test_saved_set_is_the_set(tmp_path: Path) -> None:
    path = tmp_path / "set.toml"
    nominal = parameter_sets.load()
    parameter_sets.save(nominal, path)
    assert parameter_sets.load(str(path)).parameters == nominal.parameters


@pytest.mark.slow
def test_log_of_another_rate_is_fitted_as_well(identify: Command, tmp_path: Path) -> None:
    """Every other sample: 50 Hz."""
    text = gzip.decompress(Path(RUNS[0]).read_bytes()).decode().splitlines()
    slow = tmp_path / "slow.csv"
    slow.write_text("\n".join([text[0], *text[1::2]]) + "\n")
    result = identify(slow, "--json", "-")
    by_name = {p["name"]: p for p in json.loads(result.stdout)["parameters"]}
    inertia = by_name["drum_inertia"]
    assert abs(inertia["value"] - 312.69 * 1.08) <= 4 * inertia["standard_error"]
