"""A set that the diagnosis of an axis saved is where the next diagnosis begins."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from plant_emulator import parameter_sets
from plant_emulator.cli import main
from plant_emulator.errors import LogError, ParameterError
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.workflows.diagnosis import axis_set
from plant_emulator.workflows.diagnosis.diagnose import Diagnosis, diagnose
from tests.plant_emulator.diagnosis import axis_truth as truth

Extra = Callable[..., np.ndarray]
RISE, SPEED = 15.0, 0.1


def concave(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """A friction that grows with the root of the speed [N], 15 N at 0.1 m/s."""
    return RISE * np.sqrt(np.abs(v) / SPEED) * np.sign(v)


def runs(extra: Extra, slower: float = 1.0) -> list[AxisLog]:
    """Two runs; slower : the same way in so many times the time, by the same equation."""
    found = []
    for phase, seed in ((0.0, 1), (1.0, 2)):
        t, q, v, a = truth.motion(phase)
        v, a = v / slower, a / slower**2
        force = truth.MASS * a + truth.VISCOUS * v + truth.COULOMB * np.sign(v) + truth.OFFSET
        noise = truth.NOISE * np.random.default_rng(seed).standard_normal(len(t))
        one = truth.log(phase=phase, seed=seed)
        found.append(replace(one, time=slower * t, force=force + extra(q, v, a) + noise))
    return found


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The set of an axis with concave friction, in a file."""
    path = tmp_path_factory.mktemp("set") / "axis.toml"
    first, second = runs(concave)
    found = diagnose(first, hold_out=second, model="axis")
    assert found.answer.verdict.effects == ("concave_friction",)
    parameter_sets.save(found.parameter_set, path)
    return path


def again(path: Path, logs: list[AxisLog]) -> Diagnosis:
    return diagnose(logs[0], hold_out=logs[1], model="axis", parameters=path)


@pytest.mark.slow
def test_an_axis_is_as_its_set_says_also_at_other_speeds(saved: Path) -> None:
    """The size of the friction refers to the highest speed of the runs that were fitted."""
    found = again(saved, runs(concave, slower=1.5))
    assert found.answer.verdict.kind == "none"
    assert found.answer.verdict.effects == ()
    gap = found.answer.gap
    assert gap.nominal["force"] == pytest.approx(gap.recalibrated["force"], rel=0.1)


@pytest.mark.slow
def test_another_cause_is_found_beside_the_effect_of_the_set(saved: Path) -> None:
    def both(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        return concave(q, v, a) + 0.2 * truth.VISCOUS * np.abs(v)

    found = again(saved, runs(both))
    assert found.answer.verdict.effects == ("viscous_asymmetry",)
    both_of_them = found.parameter_set.effects
    assert set(both_of_them) == {"concave_friction", "viscous_asymmetry"}
    known = parameter_sets.text(found.parameter_set)
    assert "[effects.concave_friction]" in known


@pytest.mark.slow
def test_a_heavier_axis_has_another_parameter_than_its_set(saved: Path) -> None:
    def heavier(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        return concave(q, v, a) + 0.2 * truth.MASS * a

    found = again(saved, runs(heavier))
    verdict = found.answer.verdict
    assert (verdict.kind, verdict.effects) == ("parameter", ())
    (shift,) = [one for one in verdict.parameters if one.name == "inertia"]
    assert shift.nominal == pytest.approx(truth.MASS, rel=0.01)
    assert shift.estimated == pytest.approx(1.2 * truth.MASS, rel=0.01)
    assert found.answer.gap.nominal["force"] > 2.0 * found.answer.gap.recalibrated["force"]


def test_a_set_of_the_bench_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    parameter_sets.save(parameter_sets.load(), path)
    with pytest.raises(ParameterError, match=r"bench\.toml: no set of an axis"):
        axis_set.load(path)
    words = ["diagnose", "--model", "axis", "run.csv", "--parameters", str(path)]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 2
    assert len(result.output.strip().splitlines()) == 1
    assert "bench.toml: no set of an axis" in result.output


@pytest.mark.slow
def test_an_effect_over_a_temperature_that_is_not_logged_is_refused(
    saved: Path, tmp_path: Path
) -> None:
    path = tmp_path / "warm.toml"
    text = saved.read_text().replace("concave_friction", "warm_up").replace("rise =", "ratio =")
    path.write_text(text)
    with pytest.raises(LogError, match=r"axis 1: warm_up of the parameter set .* other channels"):
        again(path, runs(concave))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("rise = ", "height = ", r"effects.concave_friction: height; rise are needed"),
        ("reference_speed", "reference_pace", r"effects.concave_friction.reference_speed is missi"),
        ("[effects.concave_friction]", "[effects.sticking]", r"effects.sticking: unknown"),
        ("[inertia]", "[mass]", r"mass is no parameter; known: inertia, viscous_friction"),
    ],
)
def test_a_faulty_set_is_refused_with_its_key(
    saved: Path, tmp_path: Path, old: str, new: str, told: str
) -> None:
    path = tmp_path / "faulty.toml"
    text = saved.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ParameterError, match=rf"faulty\.toml: {told}"):
        axis_set.known_axis(axis_set.load(path))
