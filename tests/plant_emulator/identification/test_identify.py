"""Identification against an independent bench with known parameters."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from time import process_time

import numpy as np
import pytest

from plant_emulator.errors import IdentificationError
from plant_emulator.estimation.equation_error import start_values
from plant_emulator.estimation.free_parameters import free_parameters
from plant_emulator.identification.identify import Identification, identify
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.preflight import preflight
from plant_emulator.recordings.recording import Recording, recording
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.fit_metrics import validate
from plant_emulator.simulation.programs import PROGRAMS
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import SENSORS, add_noise
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.simulation.start_in_gap import fit_start
from tests.plant_emulator.identification.practice import DEVIATIONS, FREE, truth

Reader = Callable[[str], Log]


@pytest.fixture(scope="module")
def recordings(bench_log: Reader) -> Callable[..., list[Recording]]:
    """Return a function: case, programs -> its logs ready to be fitted."""
    return lambda case, *programs: [
        recording(bench_log(f"bench_practice/{case}/program{k}")) for k in programs
    ]


@pytest.fixture(scope="module")
def fitted(
    nominal: ParameterSet, recordings: Callable[..., list[Recording]]
) -> Callable[[str], Identification]:
    """Return a function: case -> its identification from programs 1 and 3."""

    @cache
    def fit(case: str) -> Identification:
        return identify(recordings(case, 1, 3), nominal)

    return fit


def test_all_estimated_parameters_but_the_gear_inertia_are_free(nominal: ParameterSet) -> None:
    assert set(free_parameters(nominal)) == set(FREE)


@pytest.mark.slow
@pytest.mark.parametrize("case", list(DEVIATIONS))
def test_parameters_of_the_independent_bench_are_found(
    nominal: ParameterSet, fitted: Callable[[str], Identification], case: str
) -> None:
    found, true = fitted(case), truth(nominal, case)
    assert found.estimate.converged
    for parameter in found.parameters:
        error = abs(parameter.value - true[parameter.name])
        within = max(3 * parameter.standard_error, 1e-3 * true[parameter.name])
        assert error <= within, parameter.name


def friction(values: dict[str, float], speed: np.ndarray) -> np.ndarray:
    """The gear's friction at the output [N m] (thesis, eq. 3.27)."""
    level, factor = values["gear_coulomb_friction"], values["gear_viscous_friction"]
    return level + factor * speed ** values["gear_friction_exponent"]


@pytest.mark.parametrize("case", list(DEVIATIONS))
def test_what_matters_is_found_within_two_percent(
    nominal: ParameterSet, fitted: Callable[[str], Identification], case: str
) -> None:
    found = {p.name: p.value for p in fitted(case).parameters}
    true = truth(nominal, case)
    for name in ("drum_inertia", "backlash_half_gap", "dead_time", "flux_constant_1"):
        assert found[name] == pytest.approx(true[name], rel=0.02), name
    speeds = np.linspace(1.0, 6.0, 11)
    assert friction(found, speeds) == pytest.approx(friction(true, speeds), rel=0.02)
    omega = np.linspace(200.0, 480.0, 5)  # the flux above base speed, K_1 / (K_2 + omega)
    flux = [v["flux_constant_1"] / (v["flux_constant_2"] + omega) for v in (found, true)]
    assert flux[0] == pytest.approx(flux[1], rel=0.02)


@pytest.mark.parametrize("case", list(DEVIATIONS))
def test_held_out_run_is_predicted_to_the_noise(
    nominal: ParameterSet, bench_log: Reader, fitted: Callable[[str], Identification], case: str
) -> None:
    log = bench_log(f"bench_practice/{case}/program2")
    run, values = inputs_of(log), values_of(fitted(case).parameter_set)
    simulated = simulate(run, values, gap_position=fit_start(log, run, values))
    fits = validate(log, simulated)
    least = {
        "motor_speed": 99.9,
        "drum_speed": 99.7,
        "armature_current": 98.9,
        "shaft_torque": 99.0,
    }
    for name in COMPARED:
        assert fits[name].val1 >= least[name], name
        assert fits[name].rms <= 1.15 * SENSORS[name][0], name


def test_nominal_log_gives_back_the_nominal_parameters(
    nominal: ParameterSet, bench_log: Reader
) -> None:
    found = identify([recording(bench_log("bench_nominal/program1"))], nominal)
    for parameter in found.parameters:
        rel = 0.02 if parameter.name == "flux_constant_2" else 0.005
        assert parameter.value == pytest.approx(parameter.nominal, rel=rel), parameter.name
    assert found.gap_positions[0] == pytest.approx(0.0, abs=0.01)


def off(nominal: ParameterSet, seed: int) -> ParameterSet:
    """A set in which every free parameter is 20 to 50 % off, up or down."""
    random = np.random.default_rng(seed)
    factors = 1 + random.choice([-1, 1], len(FREE)) * random.uniform(0.2, 0.5, len(FREE))
    return nominal.with_values(
        {n: nominal.value(n) * f for n, f in zip(FREE, factors, strict=True)}
    )


@pytest.mark.slow
def test_starts_far_off_all_reach_the_optimum(
    nominal: ParameterSet, recordings: Callable[..., list[Recording]]
) -> None:
    logs = recordings("practice_002", 1)
    best = identify(logs, nominal)
    for seed in range(6):
        found = identify(logs, off(nominal, seed))
        assert found.estimate.cost == pytest.approx(best.estimate.cost, abs=0.05)
        for one, other in zip(found.parameters, best.parameters, strict=True):
            assert abs(one.value - other.value) <= 0.1 * other.standard_error, one.name


def test_fit_of_one_log_takes_at_most_a_second_of_processor_time(
    nominal: ParameterSet, recordings: Callable[..., list[Recording]]
) -> None:
    logs = recordings("practice_008", 1)
    identify(logs, nominal)  # compiled
    begin = process_time()
    identify(logs, nominal, (*FREE, "motor_inertia"))
    assert process_time() - begin <= 1.0


def test_log_without_field_weakening_says_nothing_of_its_flux(nominal: ParameterSet) -> None:
    """Below base speed (190 rad/s) the flux is constant: K_1 and K_2 are in no equation."""
    time = np.arange(1200) * 0.01
    reference = np.interp(time, [0, 3, 6, 9, 12], [0, 120, 120, 0, 0])
    log = Log(time, {"speed_reference": reference}, "slow")
    measured = add_noise(simulate(inputs_of(log), values_of(nominal)), seed=1)
    found = identify([recording(measured)], nominal)
    by_name = {p.name: p for p in found.parameters}
    assert not by_name["flux_constant_1"].identifiable
    assert not by_name["flux_constant_2"].identifiable
    assert by_name["drum_inertia"].identifiable
    assert by_name["flux_constant_1"].value == pytest.approx(366.83, rel=0.01)  # the prior's
    assert by_name["flux_constant_1"].standard_error == pytest.approx(18.34, rel=0.05)


def test_samples_left_out_do_not_count(nominal: ParameterSet, bench_log: Reader) -> None:
    log = bench_log("bench_practice/practice_008/program1")
    spoiled = dict(log.signals)
    spoiled["shaft_torque"] = log["shaft_torque"].copy()
    spoiled["shaft_torque"][900:1000] += 50.0
    use = np.ones(len(log.time), bool)
    use[900:1000] = False
    bad = Log(log.time, spoiled, log.source)
    found = identify([recording(bad, use={"shaft_torque": use})], nominal)
    true = truth(nominal, "practice_008")
    for p in found.parameters:
        assert abs(p.value - true[p.name]) <= 3 * p.standard_error, p.name


def test_fit_works_without_the_current(nominal: ParameterSet, bench_log: Reader) -> None:
    log = bench_log("bench_practice/practice_008/program1")
    without = Log(
        log.time, {n: v for n, v in log.signals.items() if n != "armature_current"}, log.source
    )
    found = identify([recording(without)], nominal)
    by_name = {p.name: p for p in found.parameters}
    true = truth(nominal, "practice_008")
    for name in ("drum_inertia", "backlash_half_gap", "dead_time", "gear_viscous_friction"):
        assert abs(by_name[name].value - true[name]) <= 3 * by_name[name].standard_error, name


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("inertia", "free inertia: no parameter of the bench; known: armature_resistance"),
        ("drum_shaft_stiffness", "free drum_shaft_stiffness: it is calculated from others"),
    ],
)
def test_parameter_that_cannot_be_free_is_told(nominal: ParameterSet, name: str, said: str) -> None:
    with pytest.raises(IdentificationError) as error:
        free_parameters(nominal, (name,))
    assert str(error.value).startswith(said)


def test_equations_alone_come_near(nominal: ParameterSet, bench_log: Reader) -> None:
    logs = [bench_log(f"bench_practice/practice_008/program{k}") for k in (1, 3)]
    start = start_values(logs, off(nominal, 1), FREE)
    true = truth(nominal, "practice_008")
    assert start["drum_inertia"] == pytest.approx(true["drum_inertia"], rel=0.02)
    assert start["flux_constant_1"] == pytest.approx(true["flux_constant_1"], rel=0.01)
    speeds = np.linspace(1.0, 6.0, 6)
    assert friction(start, speeds) == pytest.approx(friction(true, speeds), rel=0.03)


def test_what_is_not_free_is_believed_by_the_start(
    nominal: ParameterSet, bench_log: Reader
) -> None:
    logs = [bench_log("bench_practice/practice_004/program1")]
    start = start_values(logs, nominal, ("drum_inertia",))
    assert set(start) == {"drum_inertia"}
    assert start["drum_inertia"] == pytest.approx(312.69, rel=0.01)


@pytest.mark.slow
def test_temperature_at_the_start_belongs_to_its_run(nominal: ParameterSet) -> None:
    """Two runs with the same gear, one cold, one half warm; what the shell shows is taken."""
    own = {"viscosity_coefficient": 0.02, "start_temperature": 305.15, "shell_temperature": 305.15}
    time, reference = PROGRAMS["program1"].reference()  # type: ignore[union-attr]
    run = inputs_of(Log(time, {"speed_reference": reference}, "made"))
    recordings = []
    for seed, (oil, shell) in enumerate([(285.0, 284.0), (300.0, 298.0)]):
        there = own | {"start_temperature": oil, "shell_temperature": shell}
        values = values_of(nominal, {"gear_oil_temperature": there}) | {"drum_inertia": 330.0}
        recordings.append(recording(add_noise(simulate(run, values), seed)))
    found = identify(recordings, nominal, ("drum_inertia",), effects={"gear_oil_temperature": own})
    assert found.parameters[0].value == pytest.approx(330.0, rel=2e-3)
    temperatures = [s["gear_oil_temperature_start_temperature"] for s in found.states]
    assert temperatures == pytest.approx([285.0, 300.0], abs=0.5)
    assert found.chi_squared == pytest.approx(1.0, abs=0.05)


def test_held_channel_has_its_own_noise(nominal: ParameterSet, bench_log: Reader) -> None:
    """A torque that comes at 20 Hz and is held: left out where stale, weighed by its noise."""
    log = bench_log("bench_practice/practice_002/program1")
    held = log["shaft_torque"][np.arange(len(log.time)) // 5 * 5]
    slow = Log(log.time, {**log.signals, "shaft_torque": held}, log.source)
    use = preflight(slow, 62.6).use
    found = identify([recording(slow, use=use)], nominal)
    assert found.chi_squared == pytest.approx(1.0, abs=0.06)
    true = truth(nominal, "practice_002")
    for p in found.parameters:
        assert abs(p.value - true[p.name]) <= 3.5 * p.standard_error, p.name


def test_parameter_that_is_zero_in_the_set_is_not_free(nominal: ParameterSet) -> None:
    frictionless = nominal.with_values({"gear_coulomb_friction": 0.0})
    assert "gear_coulomb_friction" not in free_parameters(frictionless)
    with pytest.raises(IdentificationError, match="a fit needs a value above 0"):
        free_parameters(frictionless, ("gear_coulomb_friction",))


def test_parameter_at_the_end_of_its_range_is_told(
    nominal: ParameterSet, recordings: Callable[..., list[Recording]]
) -> None:
    """A set ten times too heavy: the drum of the log lies beyond a fifth of it."""
    heavy = nominal.with_values({"drum_inertia": 10.0 * nominal.value("drum_inertia")})
    (inertia,) = identify(recordings("practice_008", 1), heavy, ("drum_inertia",)).parameters
    assert inertia.at_bound
    assert not inertia.identifiable


def repeats(nominal: ParameterSet, log: Log, count: int) -> Sequence[np.ndarray]:
    """Errors over standard errors of fits to synthetic logs, one row a repeat."""
    run, rows = inputs_of(log), []
    for seed in range(count):
        random = np.random.default_rng(seed)
        true = values_of(nominal) | {
            n: nominal.value(n) * np.exp(0.5 * (nominal[n].std or 0) / nominal.value(n) * z)
            for n, z in zip(FREE, random.standard_normal(len(FREE)), strict=True)
        }
        bench = simulate(run, true, gap_position=random.uniform(-1, 1), step=5e-4)
        found = identify([recording(add_noise(bench, seed))], nominal)
        rows.append(
            np.array([(p.value - true[p.name]) / p.standard_error for p in found.parameters])
        )
    return rows


@pytest.mark.slow
def test_intervals_cover_the_truth_at_their_rate(nominal: ParameterSet, bench_log: Reader) -> None:
    errors = np.array(repeats(nominal, bench_log("bench_nominal/program1"), 20))
    covered = np.abs(errors) <= 1.96
    names = (*FREE, "armature_resistance", "flux_constant")  # the logs have the voltage
    shares = zip(names, covered.mean(0), strict=True)
    print("95 % intervals cover", {n: float(c) for n, c in shares})
    assert 0.90 <= covered.mean() <= 0.99


def test_logs_with_and_without_a_current_start_a_fit_together(
    nominal: ParameterSet, bench_log: Reader
) -> None:
    whole, other = (bench_log(f"bench_practice/practice_004/program{k}") for k in (1, 2))
    signals = {k: v for k, v in other.signals.items() if k != "armature_current"}
    logs = [whole, replace(other, signals=signals)]
    found = start_values(logs, nominal, FREE)
    assert found["drum_inertia"] == pytest.approx(312.69, rel=0.05)
    assert "flux_constant_1" not in found
