"""The command identify-truck and its library function: answer, files and every bad input."""

import gzip
import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from plant_emulator.cli import main
from plant_emulator.road_load.answer import answer_of, problems, velocity_fit
from plant_emulator.workflows.truck_identification import identify_truck
from tests.plant_emulator.road_load.test_labelled_logs import DATA, LABELS, case

Array = np.ndarray
Command = Callable[..., Result]
TORQUE, VELOCITY = "road_1_torque.csv.gz", "road_1_velocity.csv.gz"


@cache
def whole_table(name: str) -> Array:
    with gzip.open(DATA / name, "rt") as file:
        return np.loadtxt(file, delimiter=",", skiprows=1)


def table(name: str) -> Array:
    """A log of road_1 at a quarter of its rate, which is quicker to write, read and fit."""
    return whole_table(name)[::4].copy()


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., tuple[str, str]]:
    """A function that writes tables of torque and velocity to files; the default is road_1."""

    def files(torque: Array | None = None, velocity: Array | None = None) -> tuple[str, str]:
        paths = []
        for name, column, rows in [
            (TORQUE, "motor_torque_Nm", torque),
            (VELOCITY, "velocity_m_s", velocity),
        ]:
            path = tmp_path / name.removesuffix(".gz")
            written = table(name) if rows is None else rows
            np.savetxt(path, written, "%.5f", ",", header=f"time_s,{column}", comments="")
            paths.append(str(path))
        return paths[0], paths[1]

    return files


def call(*arguments: object, mass: float = 3640) -> Result:
    return CliRunner().invoke(
        main, ["identify-truck", "--mass", str(mass), *(str(one) for one in arguments)]
    )


def refusal(result: Result, code: int = 2) -> str:
    """The one line of a refusal."""
    assert result.exit_code == code, result.output
    (line,) = result.stderr.splitlines()
    assert line.startswith("error: ")
    return line


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Result, Path]:
    folder = tmp_path_factory.mktemp("truck")
    options = ["--save", folder / "truck.toml", "--json", folder / "truck.json"]
    plot = ["--plot", folder / "truck.png"]
    return call(DATA / TORQUE, DATA / VELOCITY, *options, *plot), folder


@pytest.mark.slow
def test_answer_has_the_schema_and_the_labels_values(done: tuple[Result, Path]) -> None:
    result, folder = done
    assert result.exit_code == 0, result.output
    found = json.loads((folder / "truck.json").read_text())
    assert found["schema"] == "truck/1"
    assert found["converged"] is True
    assert set(found["velocity"]) == {"val1", "val2"}
    label = LABELS["road_1"]
    low, high = found["efficiency"]["interval_95"]
    assert low < label["efficiency"] < high
    for name, value in [("crr", label["crr"]), ("f0_newton", 3640 * 9.81 * label["crr"])]:
        assert abs(found[name]["value"] - value) < 3.0 * found[name]["standard_error"]


def test_table_has_units_and_limits(done: tuple[Result, Path]) -> None:
    text = done[0].stdout
    assert "6 of 6 starts" in text
    assert "not separable: mass from torque_gain" in text
    assert any(line.split()[0] == "f0_newton" and line.endswith("N") for line in text.splitlines())


def test_saved_table_is_the_truck_with_its_origin(done: tuple[Result, Path]) -> None:
    text = (done[1] / "truck.toml").read_text()
    truck = tomllib.loads(text)["truck"]
    assert (truck["mass_kg"], truck["load_kg"], truck["wheel_radius_m"]) == (3640.0, 0.0, 0.1715)
    assert truck["f0_N"] == pytest.approx(3640 * 9.81 * LABELS["road_1"]["crr"], abs=3.0)
    assert TORQUE in text
    assert "SHA-256" in text


def test_plot_is_a_png(done: tuple[Result, Path]) -> None:
    assert (done[1] / "truck.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_library_function_gives_the_answer_of_the_command(done: tuple[Result, Path]) -> None:
    result, folder = done
    found = identify_truck(DATA / TORQUE, DATA / VELOCITY, mass=3640.0)
    assert found.converged
    assert found.to_json() == json.loads((folder / "truck.json").read_text())
    assert str(found) == result.stdout.rstrip("\n")
    assert repr(found).startswith("<TruckIdentification: crr 0.0115")
    assert (
        found.truck_table().splitlines()[-7:]
        == ((folder / "truck.toml").read_text().splitlines()[-7:])
    )


def test_swapped_files_are_refused() -> None:
    line = refusal(call(DATA / VELOCITY, DATA / TORQUE))
    assert "the order is TORQUE VELOCITY" in line


def test_wrong_sign_of_the_torque_is_refused(write: Callable[..., tuple[str, str]]) -> None:
    line = refusal(call(*write(torque=table(TORQUE) * [1, -1])))
    assert "opposite signs" in line
    assert "positive torque has to drive the truck forwards" in line


@pytest.mark.parametrize("kind", ["missing", "held", "saturated"])
def test_lost_torque_is_refused_with_time_and_length(
    write: Callable[..., tuple[str, str]], kind: str
) -> None:
    rows = table(TORQUE)
    lost = (rows[:, 0] > 30.0) & (rows[:, 0] < 31.0)
    if kind == "missing":
        rows = rows[~lost]
    elif kind == "held":
        rows[lost, 1] = rows[np.argmax(lost), 1]
    else:
        rows[:, 1] = np.minimum(rows[:, 1], 50.0)
    line = refusal(call(*write(torque=rows)))
    assert "no torque (missing, held or saturated) for" in line
    assert ("from 30" in line) is (kind != "saturated")


@pytest.mark.parametrize("kind", ["missing", "held", "saturated"])
def test_lost_velocity_is_left_out_and_the_rest_used(
    write: Callable[..., tuple[str, str]], kind: str
) -> None:
    rows = table(VELOCITY)
    lost = (rows[:, 0] > 30.0) & (rows[:, 0] < 31.0)
    if kind == "missing":
        rows = rows[~lost]
    elif kind == "held":
        rows[lost, 1] = rows[np.argmax(lost), 1]
    else:
        rows[:, 1] = np.minimum(rows[:, 1], 4.0)
    result = call(*write(velocity=rows), "--json", "-")
    assert result.exit_code == 0, result.output
    crr = json.loads(result.stdout)["crr"]
    assert abs(crr["value"] - LABELS["road_1"]["crr"]) < 3.0 * crr["standard_error"]


def test_velocity_that_jumps_is_refused(write: Callable[..., tuple[str, str]]) -> None:
    rows = table(VELOCITY)
    rows[(rows[:, 0] > 10.0) & (rows[:, 0] < 10.3), 1] = 0.0
    assert "the velocity jumps by" in refusal(call(*write(velocity=rows)))


def test_standstill_only_is_refused(write: Callable[..., tuple[str, str]]) -> None:
    rows = table(VELOCITY) * [1, 0]
    assert "the truck stands" in refusal(call(*write(velocity=rows)))


def test_cruise_only_is_too_little_excitation(write: Callable[..., tuple[str, str]]) -> None:
    logs = table(TORQUE), table(VELOCITY)
    parts = [rows[(rows[:, 0] > 10) & (rows[:, 0] < 16)] for rows in logs]
    assert "too little excitation" in refusal(call(*write(*parts)))


def test_logs_without_common_time_are_refused(write: Callable[..., tuple[str, str]]) -> None:
    line = refusal(call(*write(velocity=table(VELOCITY) + np.array([100, 0]))))
    assert "100 .. 159.996 s; at least 5 s in common are needed" in line


@pytest.mark.parametrize("first_torque", [0, 1000])
def test_logs_of_different_length_are_compared_where_both_are(
    write: Callable[..., tuple[str, str]], first_torque: int
) -> None:
    files = write(torque=table(TORQUE)[first_torque:], velocity=table(VELOCITY)[1250:8750])
    result = call(*files, "--json", "-")
    assert result.exit_code == 0, result.output
    efficiency = json.loads(result.stdout)["efficiency"]
    distance = abs(efficiency["value"] - LABELS["road_1"]["efficiency"])
    assert distance < 3.0 * efficiency["standard_error"]


def test_another_mass_than_the_load_cell_allows_fails_and_saves_nothing(
    tmp_path: Path, write: Callable[..., tuple[str, str]]
) -> None:
    """5240 kg instead of 3640 kg: the gain would have to be 0.9905 * 3640 / 5240 = 0.688."""
    saved = tmp_path / "truck.toml"
    result = call(*write(), "--save", saved, "--json", "-", mass=5240)
    line = refusal(result, 1)
    assert "gain would be 0.688" in line
    assert "are mass, gear ratio and wheel radius right?" in line
    assert json.loads(result.stdout)["converged"] is False
    assert not saved.exists()


def test_zero_of_the_load_cell_that_moves_fails(write: Callable[..., tuple[str, str]]) -> None:
    """The zero moves by 0.5 N m in the middle of the log, which is 9 % of C_rr."""
    torque = table(TORQUE)
    torque[len(torque) // 2 :, 1] += 0.5
    line = refusal(call(*write(torque=torque)), 1)
    assert "the load cell's zero moves from standstill to standstill" in line


def test_velocity_of_another_run_fails(write: Callable[..., tuple[str, str]]) -> None:
    result = call(*write(velocity=whole_table("road_3_velocity.csv.gz")[::4]))
    assert "both logs of one run?" in refusal(result, 1)


@pytest.mark.slow
def test_search_that_did_not_converge_is_reported() -> None:
    unsettled = replace(case("road_1").fit, settled=False)
    found = answer_of(unsettled)
    assert found.converged is False
    assert found.to_json()["problems"] == ["the search ended before it converged"]


def test_value_at_its_bound_is_a_problem() -> None:
    found = case("road_1").fit
    at_bound = replace(found, values=replace(found.values, efficiency=1.0))
    [text] = problems(at_bound, velocity_fit(found))
    assert text == "efficiency ended at its bound 1"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("time_s,velocity_m_s\n0,1\n1,nan\n", "line 3, column velocity_m_s: 'nan'"),
        ("time_s,velocity_m_s\n0,1\n1,x\n", "line 3, column velocity_m_s: 'x'"),
        ("time_s,velocity_m_s\n0,1\n0,1\n", "line 3, column time_s: 0 after 0"),
        ("time_s,velocity_m_s\n0,1\n1\n", "line 3: 1 values; 2 columns are expected"),
        ("time_s,velocity_m_s\n", "0 samples; at least 2 are needed"),
        ("time_s,velocity_km_h\n0,1\n", "column velocity_km_h; expected velocity_m_s"),
        ("time_s,speed\n0,1\n1,2\n", "column velocity_m_s is missing; the file given as VELOCITY"),
        ("velocity_m_s\n0\n", "column time_s is missing"),
        ("time_s,velocity_m_s\n0,1\n1,2\n", "2 samples; a run of some seconds"),
    ],
)
def test_fault_of_a_file_is_reported_with_its_place(tmp_path: Path, text: str, fault: str) -> None:
    path = tmp_path / "velocity.csv"
    path.write_text(text)
    line = refusal(call(DATA / TORQUE, path))
    assert str(path) in line
    assert fault in line


@pytest.mark.parametrize("content", [b"\x1f\x8bdamaged", b"\xff\xfe\x00"])
def test_file_that_is_no_text_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "torque.csv"
    path.write_bytes(content)
    assert str(path) in refusal(call(path, DATA / VELOCITY))


@pytest.mark.parametrize(
    ("option", "value"),
    [("--mass", "nan"), ("--mass", "0"), ("--ratio", "-14"), ("--gain-uncertainty", "0")],
)
def test_impossible_truck_is_refused(option: str, value: str) -> None:
    assert option in refusal(call(DATA / TORQUE, DATA / VELOCITY, option, value))


def test_missing_file_is_refused() -> None:
    assert "nowhere.csv" in refusal(call("nowhere.csv", DATA / VELOCITY))
