"""A single axis: a synthetic one of which everything is known."""

import pickle
import re
from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.diagnosis.diagnose import Diagnose
from plant_emulator.diagnosis.execution.pool import InProcess, TaskRunner
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.explanation import Explanation
from plant_emulator.diagnosis.fitting.joint_fit import fit_null, linearise
from plant_emulator.diagnosis.fitting.looks import glance, look
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.fitting.signature import signature
from plant_emulator.diagnosis.machines.axis import AxisModel, AxisRecipe
from plant_emulator.diagnosis.machines.axis_effects import EFFECTS
from plant_emulator.diagnosis.machines.axis_signals import prepare
from plant_emulator.diagnosis.prediction.held_out import NOMINAL, HeldOut, Plan
from plant_emulator.errors import LogError
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.signals.frequency_bands import power
from plant_emulator.workflows.diagnosis.plan import plan_of_runs
from tests.plant_emulator.diagnosis import axis_truth as truth

PLANTED: dict[str, tuple[Callable[..., np.ndarray], str, float]] = {
    "viscous_asymmetry": (lambda q, v, a: 0.2 * truth.VISCOUS * np.abs(v), "ratio", 0.2),
    "stribeck": (lambda q, v, a: 20.0 * np.exp(-((v / 0.02) ** 2)) * np.sign(v), "rise", 20.0),
    "load_dependence": (lambda q, v, a: 0.1 * truth.MASS * np.abs(a) * np.sign(v), "ratio", 0.1),
    "screw_ripple": (lambda q, v, a: 3.0 * np.cos(2.0 * np.pi * q / 0.005), "cosine", 3.0),
}


def contest(model: AxisModel, runs: tuple[int, ...]) -> tuple[FitResult, dict[str, FitResult]]:
    """The fit without effects, and the joint fit of every effect that shows at all."""
    null = fit_null(model, runs)
    tangents = NuisanceSpace(linearise(model, null, runs))
    found = {name: signature(model, name, null, runs, tangents) for name in model.candidates}
    return null, {
        name: look(model, (name,), runs, glance(model, one, null, runs, tangents.estimate))
        for name, one in found.items()
        if one is not None
    }


@pytest.fixture(scope="module")
def nominal() -> AxisModel:
    return AxisModel([truth.log(), truth.log(phase=1.0, seed=2)])


def test_an_axis_without_effects_gives_its_parameters_and_white_residuals(
    nominal: AxisModel,
) -> None:
    found = fit_null(nominal, (0,))
    expected = {
        "inertia": truth.MASS,
        "viscous_friction": truth.VISCOUS,
        "coulomb_friction": truth.COULOMB,
        "offset": truth.OFFSET,
    }
    for name, value in expected.items():
        assert found.values[name] == pytest.approx(value, rel=0.01)
        assert abs(found.values[name] - value) < 4.0 * found.standard_errors[name]
    assert found.mean_square == pytest.approx(1.0, abs=0.1)
    assert found.effective_fraction > 0.7


def test_an_axis_without_effects_gives_none_of_them_any_evidence(nominal: AxisModel) -> None:
    null, found = contest(nominal, (0, 1))
    assert max(null.cost - point.cost for point in found.values()) < 25.0


def test_noise_is_that_of_the_force_in_the_band() -> None:
    # a low pass at 0.8 of half the rate, thinned out tenfold, keeps 0.08 of the power, and of a
    # Chebyshev filter with its ripple of 0.05 dB twice nearly that
    [run] = AxisModel([truth.log()]).runs
    assert run.noise[0] == pytest.approx(truth.NOISE * np.sqrt(0.08), rel=0.05)


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_effect_is_first_and_has_its_size(name: str) -> None:
    extra, key, size = PLANTED[name]
    model = AxisModel([truth.log(extra), truth.log(extra, phase=1.0, seed=2)])
    _, found = contest(model, (0, 1))
    assert min(found, key=lambda effect: found[effect].cost) == name
    assert found[name].values[f"{name}_{key}"] == pytest.approx(size, rel=0.05)
    assert found[name].mean_square == pytest.approx(1.0, abs=0.1)


def test_directions_differ_by_what_the_ratio_says() -> None:
    forwards, backwards = 1.3 * truth.VISCOUS, 0.7 * truth.VISCOUS
    law = EFFECTS["viscous_asymmetry"].law
    for speed, expected in ((0.1, forwards * 0.1), (-0.1, -backwards * 0.1)):
        moved = type("M", (), {"velocity": np.array([speed])})()
        values = {"viscous_asymmetry_ratio": 0.3, "viscous_friction": truth.VISCOUS}
        base = np.array([truth.VISCOUS * speed])
        assert law(base, moved, values, None)[0] == pytest.approx(expected)


def test_coulomb_friction_by_direction_cannot_be_told_from_the_offset() -> None:
    extra = lambda q, v, a: 0.3 * truth.COULOMB * np.abs(np.sign(v))  # noqa: E731
    model = AxisModel([truth.log(extra)])
    null = fit_null(model, (0,))
    found = signature(
        model, "coulomb_asymmetry", null, (0,), NuisanceSpace(linearise(model, null, (0,)))
    )
    assert null.values["offset"] == pytest.approx(truth.OFFSET + 0.3 * truth.COULOMB, rel=0.05)
    assert found is None or found.orthogonal_norm < 1e-3 * found.total_norm


def test_a_delay_beyond_a_sample_is_first_and_has_its_length() -> None:
    model = AxisModel([truth.log(force_late=0.003), truth.log(phase=1.0, seed=2, force_late=0.003)])
    _, found = contest(model, (0, 1))
    assert min(found, key=lambda effect: found[effect].cost) == "delay"
    assert found["delay"].values["delay_time"] == pytest.approx(0.003, rel=0.05)


def two_masses(share: float, frequency: float, damping: float) -> AxisLog:
    """A motor that carries a part of its mass on a spring, integrated in steps of 0.05 ms."""
    from scipy.signal import StateSpace, lsim

    hung, held = share * truth.MASS, (1.0 - share) * truth.MASS
    k, c = hung * frequency**2, 2.0 * damping * frequency * hung
    system = StateSpace(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-k / held, -(c + truth.VISCOUS) / held, k / held, c / held],
            [0.0, 0.0, 0.0, 1.0],
            [k / hung, c / hung, -k / hung, -c / hung],
        ],
        [[0.0], [1.0 / held], [0.0], [0.0]],
        [[1.0, 0.0, 0.0, 0.0]],
        [[0.0]],
    )
    fine = np.arange(0.0, truth.LENGTH, 5e-5)
    tones = [(40.0, 0.4), (40.0, 3.0), (4.0, 11.0), (4.0, 19.0), (4.0, 27.0), (4.0, 33.0)]
    drive = sum(size * np.sin(2.0 * np.pi * f * fine) for size, f in tones)
    _, position, _ = lsim(system, drive, fine)
    random = np.random.default_rng(3)
    force = np.asarray(drive)[::20]
    return AxisLog(
        time=fine[::20],
        position=position[::20],
        force=force + 0.5 * random.standard_normal(len(force)),
        rotary=False,
        source="two masses",
    )


def test_elasticity_is_that_of_two_masses_on_a_spring() -> None:
    frequency = 2.0 * np.pi * 24.0
    model = AxisModel([two_masses(0.4, frequency, 0.04)])
    _, found = contest(model, (0,))
    assert min(found, key=lambda effect: found[effect].cost) == "elasticity"
    values = found["elasticity"].values
    assert values["elasticity_share"] == pytest.approx(0.4, rel=0.05)
    assert values["elasticity_frequency"] == pytest.approx(frequency, rel=0.02)


def test_a_force_that_holds_a_resting_axis_does_not_count() -> None:
    log = truth.log()
    t, q, force = log.time, log.position.copy(), log.force.copy()
    rests = t > 13.0
    q[rests] = q[rests][0]
    force[rests] = 15.0
    halted = AxisLog(time=t, position=q, force=force, rotary=False, source="halted")
    model = AxisModel([halted])
    residual = model.residual(0, ())(fit_null(model, (0,)).values)[0]
    late = model.runs[0].time > 13.2
    assert not residual[late].any()
    assert residual[~late & (model.runs[0].time < 12.8)].all()


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_is_absent_at_its_neutral_sizes(name: str, nominal: AxisModel) -> None:
    values, _ = nominal.start_values((0,))
    candidate = nominal.candidates[name]
    shapes = {u.name: u.start for u in candidate.shapes}
    there = nominal.residual(0, (name,))({**values, **shapes, **candidate.neutral})
    assert there == pytest.approx(nominal.residual(0, ())(values), abs=1e-9)


def test_every_unknown_starts_within_its_bounds_and_has_a_unit(nominal: AxisModel) -> None:
    for candidate in nominal.candidates.values():
        for unknown in (*candidate.sizes, *candidate.shapes):
            assert unknown.lower <= unknown.start <= unknown.upper
            assert candidate.units[unknown.name]
    assert set(nominal.units) == set(nominal.subsystems) == {u.name for u in nominal.parameters}


def test_a_rotary_axis_has_torques_and_radians() -> None:
    log = truth.log()
    turned = AxisLog(
        time=log.time, position=log.position, force=log.force, rotary=True, source="turned"
    )
    model = AxisModel([turned])
    assert model.runs[0].channels == ("torque",)
    assert model.units["inertia"] == "kg m^2"
    assert model.candidates["stribeck"].units["stribeck_speed"] == "rad/s"
    assert model.scale.pitch == pytest.approx(2.0 * np.pi)


def test_a_recipe_builds_the_model_without_what_is_left_out() -> None:
    recipe = AxisRecipe((truth.log(),), without=("stribeck",))
    copy = pickle.loads(pickle.dumps(recipe))
    assert set(copy.build().candidates) == set(EFFECTS) - {"stribeck"}
    assert copy.digest() == recipe.digest()
    assert copy.digest() != AxisRecipe((truth.log(seed=2),), without=("stribeck",)).digest()


def test_bad_logs_are_refused() -> None:
    log = truth.log()
    gap = np.r_[log.time[:5000], log.time[5000:] + 0.5]
    cases = {
        "even samples": AxisLog(
            time=gap, position=log.position, force=log.force, rotary=False, source="x"
        ),
        "position does not move": AxisLog(
            time=log.time, position=0.0 * log.time, force=log.force, rotary=False, source="x"
        ),
        "force does not move": AxisLog(
            time=log.time, position=log.position, force=0.0 * log.time, rotary=False, source="x"
        ),
        "a run of 2 s": AxisLog(
            time=log.time[:900],
            position=log.position[:900],
            force=log.force[:900],
            rotary=False,
            source="x",
        ),
    }
    slow = slice(None, None, len(log.time) // 90)
    cases["100 or more"] = AxisLog(
        time=log.time[slow],
        position=log.position[slow],
        force=log.force[slow],
        rotary=False,
        source="x",
    )
    for told, bad in cases.items():
        with pytest.raises(LogError, match=f"x: .*{told}"):
            AxisModel([bad])
    turned = AxisLog(
        time=log.time, position=log.position, force=log.force, rotary=True, source="turned"
    )
    with pytest.raises(LogError, match=r"turned: rotary .*logs of one axis"):
        AxisModel([log, turned])


def test_run_of_which_the_ends_leave_little_is_refused() -> None:
    """By hand: 3 s are 15 samples at 5 a second, less than the 8 at either end."""
    log = truth.log()
    start = log.time <= log.time[0] + 3.0
    short = AxisLog(
        time=log.time[start],
        position=log.position[start],
        force=log.force[start],
        rotary=False,
        source="x",
    )
    with pytest.raises(LogError, match=r"x: 0 samples are left of .* at 5 a second"):
        prepare(short, 5.0)


def test_power_of_white_noise_is_its_variance_over_half_its_rate() -> None:
    white = 3.0 * np.random.default_rng(4).standard_normal(200_000)
    assert power(white, 0.01) == pytest.approx(np.full(6, 9.0 / 50.0), rel=0.1)


def test_a_tone_lies_in_its_band() -> None:
    tone = np.sin(2.0 * np.pi * 27.0 * np.arange(0.0, 30.0, 0.01))
    found = power(tone, 0.01)
    assert int(np.argmax(found)) == 4
    assert found[4] > 1e6 * np.delete(found, 4).max()


def test_nominal_axis_of_a_held_out_run_is_that_of_the_other_runs() -> None:
    """Offsets 20 N apart, each run predicted by the least squares of the other."""
    raised = truth.log(lambda q, _v, _a: 20.0 + 0.0 * q, seed=2)
    recipe = AxisRecipe((truth.log(seed=1), raised))
    model = recipe.build()
    plan = Plan(fitted=(0, 1), folds=(((1,), (0,)), ((0,), (1,))))
    null = fit_null(model, (0, 1))
    nothing = Explanation(null=null, final=null, hypotheses=(), alternatives={}, unconverged="")

    runner = TaskRunner(pool=InProcess(), recipe=recipe, model=model, runs=plan.fitted)
    held_out = HeldOut(runner=runner, plan=plan)
    found = held_out.predictions(nothing, (), plan.folds)[NOMINAL]
    left = [one.residuals[0][0] * model.runs[k].noise[0] for k, one in enumerate(found)]
    assert [float(e[e != 0.0].mean()) for e in left] == pytest.approx([-20.0, 20.0], abs=1.0)


@pytest.mark.slow
def test_two_machines_are_told_and_no_effect_is_named() -> None:
    """80 kg, and 20 kg of which each log alone agrees with the equations."""
    lighter = truth.log(lambda _q, _v, a: -60.0 * a, phase=0.7, seed=2)
    recipe = AxisRecipe((truth.log(), lighter), fitted=(0, 1))
    found = Diagnose(InProcess(), recipe, plan_of_runs(2, 2), settings={}).diagnose().answer.verdict
    assert (found.kind, found.effects) == ("unknown", ())
    masses = r"inertia is (\S+) .* kg in axis 1 and (\S+) .* kg in axis 2"
    told = re.search(masses, found.statement)
    assert told is not None
    assert [float(mass) for mass in told.groups()] == pytest.approx([80.0, 20.0], abs=0.1)
