"""The commands simulate, validate and effects, as an operator calls them."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from plant_emulator import effects, logs
from plant_emulator.cli import main

DATA = Path(__file__).parents[2] / "data"
PROGRAM1 = str(DATA / "bench_nominal" / "program1.csv.gz")
NOISY = str(DATA / "bench_practice" / "practice_004" / "program2.csv.gz")
Command = Callable[..., Result]


@pytest.fixture
def command() -> Command:
    """A function that calls plant-emulator with its arguments and returns the result."""
    return lambda *arguments: CliRunner().invoke(main, [str(a) for a in arguments])


def refusal(result: Result) -> str:
    """The one line of a refusal."""
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith("error: ")
    return line.removeprefix("error: ")


# --- simulate ---------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "samples"), [("program1", 1851), ("program2", 2501), ("program6", 3001)]
)
def test_simulated_program_is_a_log_that_validates(
    command: Command, tmp_path: Path, program: str, samples: int
) -> None:
    out = tmp_path / "run.csv.gz"
    assert command("simulate", "--program", program, "--out", out).exit_code == 0
    assert len(logs.read(out).time) == samples
    answer = json.loads(command("validate", out, "--json", "-").stdout)
    assert all(fit["nrmsd"] < 1e-3 for fit in answer["logs"][str(out)].values())


def test_simulated_program_is_the_independent_log(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    command("simulate", "--program", "program1", "--out", out)
    ours, theirs = logs.read(out), logs.read(PROGRAM1)
    for name in ("motor_speed", "drum_speed", "armature_current", "shaft_torque"):
        rms = np.sqrt(np.mean((ours[name] - theirs[name]) ** 2))
        assert rms <= 2e-4 * np.ptp(theirs[name]), name


def test_log_goes_to_standard_output_without_out(command: Command) -> None:
    result = command("simulate", "--program", "program1")
    assert result.exit_code == 0
    assert result.stdout.startswith("time_s,speed_reference_rad_s,")
    assert len(result.stdout.splitlines()) == 1852
    assert result.stderr == ""


def test_logged_run_is_simulated_from_its_inputs(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    assert command("simulate", "--program", PROGRAM1, "--out", out).exit_code == 0
    assert logs.read(out)["drum_speed"][1000] == pytest.approx(380 / 62.6, rel=1e-2)


def test_seed_adds_the_sensors_noise_again_and_again_the_same(
    command: Command, tmp_path: Path
) -> None:
    paths = [tmp_path / f"{k}.csv" for k in range(3)]
    for path, seed in zip(paths, (1, 1, 2), strict=True):
        command("simulate", "--program", "program1", "--seed", seed, "--out", path)
    assert paths[0].read_bytes() == paths[1].read_bytes() != paths[2].read_bytes()
    still = logs.read(paths[0])["shaft_torque"][:50]
    assert np.std(still) == pytest.approx(0.25, rel=0.3)


def test_effect_shows_in_the_simulated_log(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    lag = "torque_sensor_lag:time_constant=0.2"
    command("simulate", "--program", "program1", "--effect", lag, "--out", out)

    def fits(*options: str) -> dict[str, dict[str, float]]:
        answer = command("validate", out, "--start", "middle", "--json", "-", *options)
        found: dict[str, dict[str, float]] = json.loads(answer.stdout)["logs"][str(out)]
        return found

    assert fits()["shaft_torque"]["nrmsd"] > 0.01
    assert fits()["armature_current"]["nrmsd"] < 1e-4
    assert fits("--effect", lag)["shaft_torque"]["nrmsd"] < 1e-4


def test_other_parameters_show_in_the_simulated_log(command: Command, tmp_path: Path) -> None:
    shipped = effects.load("torque_sensor_lag").file
    text = (Path(shipped).parents[1] / "parameter_sets" / "thesis_table_3_1.toml").read_text()
    own, out = tmp_path / "stiff.toml", tmp_path / "run.csv"
    own.write_text(text.replace("value = 345.38", "value = 400.0"))
    command("simulate", "--program", "program1", "--parameters", own, "--out", out)
    torque = logs.read(out)["shaft_torque"][1300]
    expected = -(35.989 + 400.0 * (380.0 / 62.6) ** 0.4418) / 62.6
    assert torque == pytest.approx(expected, rel=0.02)


# --- validate ---------------------------------------------------------------------------------


def test_validation_answers_in_the_form_validation_1(command: Command, tmp_path: Path) -> None:
    answer_file = tmp_path / "answer.json"
    result = command("validate", PROGRAM1, NOISY, "--json", answer_file)
    assert result.exit_code == 0
    answer = json.loads(answer_file.read_text())
    assert answer["schema"] == "validation/1"
    assert list(answer["logs"]) == [PROGRAM1, NOISY]
    for channels in answer["logs"].values():
        assert set(channels) == {"motor_speed", "drum_speed", "armature_current", "shaft_torque"}
        for fit in channels.values():
            assert set(fit) == {"val1", "val2", "nrmsd"}
            assert fit["val1"] == pytest.approx(100 * (1 - fit["nrmsd"]))
    assert answer["logs"][PROGRAM1]["armature_current"]["val1"] >= 99.98
    assert "armature_current" in result.stdout  # the table as well


def test_json_on_standard_output_stands_alone(command: Command) -> None:
    result = command("validate", PROGRAM1, "--json", "-", "--start", "middle")
    assert json.loads(result.stdout)["schema"] == "validation/1"
    assert result.stderr == ""


def test_log_without_optional_current_is_validated_on_the_rest(
    command: Command, tmp_path: Path
) -> None:
    log, path = logs.read(PROGRAM1), tmp_path / "run.csv"
    signals = {k: v for k, v in log.signals.items() if k != "armature_current"}
    logs.write(type(log)(log.time, signals), path)
    answer = json.loads(command("validate", path, "--json", "-").stdout)
    assert set(answer["logs"][str(path)]) == {"motor_speed", "drum_speed", "shaft_torque"}


@pytest.mark.slow
def test_plot_is_drawn(command: Command, tmp_path: Path) -> None:
    picture = tmp_path / "fit.png"
    assert command("validate", PROGRAM1, NOISY, "--plot", picture).exit_code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 30_000


# --- effects ----------------------------------------------------------------------------------


def test_effects_are_listed_with_their_subsystem(command: Command) -> None:
    lines = command("effects").stdout.splitlines()
    assert [line.split()[0] for line in lines] == effects.names()
    assert lines[effects.names().index("torque_sensor_lag")].split()[1] == "torque_sensor"


@pytest.mark.parametrize("name", effects.names())
def test_one_effect_is_shown_with_equation_source_and_parameters(
    command: Command, name: str
) -> None:
    page = command("effects", name).stdout
    assert page.startswith(name)
    assert "Source" in page
    assert all(key in page for key in effects.load(name).parameters)


def test_effects_of_an_axis_are_shown_with_the_units_of_both_kinds(command: Command) -> None:
    page = command("effects", "--model", "axis", "backlash").stdout
    assert page.startswith("backlash (backlash_shaft)")
    assert [line.split() for line in page.splitlines() if line.startswith("gap")] == [
        ["gap", "m", "rad"]
    ]
    answer = json.loads(command("effects", "--model", "axis", "--json", "-").stdout)
    drag = next(e for e in answer["effects"] if e["effect"] == "quadratic_drag")
    (size,) = drag["parameters"]
    assert (size["unit"], size["unit_rotary"]) == ("N s^2/m^2", "N m s^2/rad^2")


def test_effects_as_json_hold_every_parameter_with_its_unit(command: Command) -> None:
    answer = json.loads(command("effects", "--json", "-").stdout)
    assert [entry["effect"] for entry in answer["effects"]] == effects.names()
    lag = next(e for e in answer["effects"] if e["effect"] == "torque_sensor_lag")
    assert lag["subsystem"] == "torque_sensor"
    own = [(p["name"], p["unit"]) for p in lag["parameters"]]
    assert own == [("time_constant", "s"), ("second_order", "1")]


# --- refusals ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("simulate", "--program", "program9"), "program9: no such program; known: program1"),
        (("simulate", "--program", "program1", "--effect", "gear_ghost"), "effect gear_ghost"),
        (
            ("simulate", "--program", "program1", "--effect", "torque_sensor_lag:tau=1"),
            "tau is no parameter of torque_sensor_lag; known: time_constant",
        ),
        (
            ("simulate", "--program", "program1", "--effect", "torque_sensor_lag:time_constant=9"),
            "time_constant=9.0; 0 to 1 s is allowed",
        ),
        (("simulate", "--program", "program1", "--parameters", "ghost.toml"), "ghost.toml"),
        (("simulate", "--program", "program1", "--out", "run.xlsx"), "run.xlsx: no log format"),
        (("simulate", "--program", "program1", "--out", "ghost/run.csv"), "ghost/run.csv"),
        (("simulate", "--program", "program1", "--seed", "one"), "'one' is not a valid integer"),
        (("simulate",), "--program"),
        (("validate", "ghost.csv"), "ghost.csv: no such file"),
        (("validate",), "LOG"),
        (("validate", PROGRAM1, "--start", "left"), "left"),
        (("effects", "gear_ghost"), "effect gear_ghost: unknown; known: armature_reaction"),
        (("effects", "--model", "axis", "ghost"), "effect ghost: unknown; known: backlash"),
        (("draft-check", "ghost.py", NOISY), "ghost.py: no Python file with an effect"),
        (("simulate", "--program", "program1", "--json", "-"), "--json"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_in_one_line(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...], said: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert said in refusal(command(*arguments))
    assert not any(tmp_path.iterdir())


BREAKS_DOWN = '''"""A torque on the drum that no number is."""

from plant_emulator.effects import EffectParameter

SUBSYSTEM = "drum"
PARAMETERS = {
    "a": EffectParameter(
        neutral=0.0, lower=-5.0, upper=5.0, plausible=1.0, unit="N m", meaning="a"
    )
}


def drum_torque(value, s, p):
    return value if p.hopeless_a == 0.0 else value + p.hopeless_a * 1e300 * 1e300
'''


@pytest.mark.slow
def test_effect_that_cannot_be_simulated_is_refused_in_one_line(
    command: Command, tmp_path: Path
) -> None:
    file = tmp_path / "hopeless.py"
    file.write_text(BREAKS_DOWN, encoding="utf-8")
    said = refusal(command("draft-check", file, NOISY, NOISY.replace("program2", "program1")))
    assert said == (
        f"{file}: the bench cannot be simulated with the plausible values of hopeless; "
        "smaller ones are expected"
    )


def test_faulty_log_is_refused_with_file_line_and_column(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = logs.csv.text(logs.read(PROGRAM1)).splitlines()
    rows[100] = rows[100].replace(rows[100].split(",")[2], "fast")
    path.write_text("\n".join(rows))
    said = refusal(command("validate", path))
    assert said == f"{path}: line 101, column motor_speed_rad_s: 'fast'; expected a number"


def test_log_that_never_moves_is_refused(command: Command, tmp_path: Path) -> None:
    log, path = logs.read(PROGRAM1), tmp_path / "still.csv"
    logs.write(type(log)(log.time[:40], {k: 0 * v[:40] for k, v in log.signals.items()}), path)
    assert "motor_speed: it does not move" in refusal(command("validate", path))
