"""Road load from coast-downs of the thesis's trucks, simulated by hand, with grade and noise."""

import json
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

from plant_emulator.cli import main
from plant_emulator.errors import LogError
from plant_emulator.road_load.coast_down import CoastDown, fit, roll_out

# Mass [kg], F0 [N], F1 [N s/m]: thesis, Table 4.1, without load and with 1600 kg.
TRUCKS = [(3640.0, 418.5, 0.52), (5240.0, 588.4, 0.35)]
GRADE = 0.001 * 9.81
STEP, NOISE = 0.05, 0.02


@cache
def rolling(mass, f0, f1, direction):
    """Speed at 20 Hz: 2 s of travel at 14 km/h, then a roll-out to standstill."""
    inertia = mass + 0.03 * (mass + 25.0)
    fine, speed, speeds = 0.001, 14.0 / 3.6, []
    for number in range(60_000):
        if number * fine > 2.0:
            force = f0 + f1 * speed + direction * GRADE * mass
            speed = max(0.0, speed - fine * force / inertia)
        speeds.append(speed)
    return np.array(speeds[:: round(STEP / fine)])


def coasting(mass, f0, f1, *, direction=1, seed=0, noise=NOISE):
    """Time and velocity of a roll-out at 20 Hz."""
    taken = rolling(mass, f0, f1, direction)
    random = np.random.default_rng(seed)
    return np.arange(len(taken)) * STEP, direction * taken + noise * random.standard_normal(
        len(taken)
    )


def identified(truck, seed, *, noise=NOISE) -> CoastDown:
    runs = [
        roll_out(str(k), *coasting(*truck, direction=side, seed=4 * seed + k, noise=noise))
        for k, side in enumerate((1, -1, 1, -1))
    ]
    return fit(runs, truck[0])


@pytest.mark.parametrize("truck", TRUCKS)
def test_without_noise_the_truck_and_its_grade_come_back(truck):
    found = identified(truck, 0, noise=0.0)
    assert found.f0.value == pytest.approx(truck[1], abs=0.05)
    assert found.f1.value == pytest.approx(truck[2], abs=0.03)
    assert found.grade.value == pytest.approx(GRADE * truck[0], abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("truck", TRUCKS)
def test_truth_lies_within_two_standard_errors_as_often_as_it_should(truck):
    """95 % of 40 draws for each value; at least 34 of 40 has a probability of 0.99."""
    found = [identified(truck, seed) for seed in range(40)]
    for name, value in (("f0", truck[1]), ("f1", truck[2])):
        near = [
            abs(getattr(one, name).value - value) < 2.0 * getattr(one, name).standard_error
            for one in found
        ]
        assert sum(near) >= 34
    assert np.median([one.force_error for one in found]) < 0.005


def test_runs_in_one_direction_do_not_tell_the_grade():
    run = roll_out("out", *coasting(*TRUCKS[0]))
    with pytest.raises(LogError, match="2 coast-downs, all in one direction"):
        fit([run, run], 3640.0)


def test_a_log_without_a_roll_out_is_refused_by_its_name():
    time = np.arange(0.0, 20.0, 0.05)
    with pytest.raises(LogError, match=r"steady\.csv: shows no roll-out"):
        roll_out("steady.csv", time, np.full_like(time, 3.0))
    with pytest.raises(LogError, match=r"slow\.csv: a sample every 0\.2 s"):
        roll_out("slow.csv", time * 4.0, np.linspace(4.0, 0.0, len(time)))


def written(folder, name, **options):
    time, velocity = coasting(*TRUCKS[0], **options)
    rows = (f"{t:.3f},{v:.4f}" for t, v in zip(time, velocity, strict=True))
    path = folder / name
    path.write_text("\n".join(("time_s,velocity_m_s", *rows)) + "\n")
    return str(path)


def test_the_command_gives_a_truck_for_the_gateway(tmp_path):
    logs = [written(tmp_path, "out.csv"), written(tmp_path, "back.csv", direction=-1, seed=1)]
    save = tmp_path / "truck.toml"
    arguments = ["identify-truck", "--coast-down", *logs, "--mass", "3640", "--save", str(save)]
    result = CliRunner().invoke(main, [*arguments, "--json", "-"])
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert told["schema"] == "truck/1"
    assert told["f0_newton"]["value"] == pytest.approx(418.5, abs=6.0)
    assert told["crr"]["value"] == pytest.approx(418.5 / (3640.0 * 9.81), rel=0.015)
    from gateway.config_file import load

    assert load(save).truck.f0 == pytest.approx(told["f0_newton"]["value"], rel=1e-5)


def test_more_than_two_logs_are_for_coast_downs_only():
    result = CliRunner().invoke(main, ["identify-truck", "a", "b", "c", "--mass", "3640"])
    assert result.exit_code == 2
    assert "only --coast-down takes more than two logs" in result.stderr
