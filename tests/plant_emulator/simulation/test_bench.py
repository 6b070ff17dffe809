"""The running bench of the emulator."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.errors import EmulatorError, ParameterError, UnsettledError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.solver.kernel import Kernel
from tests.plant_emulator.runs import linear, simulate


def references(end: float, steps: int) -> list[float]:
    """A ramp of 100 rad/s^2 in steps of 1 ms, then constant."""
    return [min(0.1 * (k + 1), end) for k in range(steps)]


def test_running_bench_is_the_simulation_with_the_same_steps(nominal: ParameterSet) -> None:
    samples = Bench(nominal).advance(references(120.0, 2000))
    log = simulate(linear((0.0, 0.0), (1.2, 120.0), duration=2.0), nominal.values())
    for name in ("motor_speed", "drum_speed", "armature_current", "shaft_torque"):
        running, whole = getattr(samples, name)[9::10], log[name][1:]
        assert np.abs(running - whole).max() <= 2e-2 * np.ptp(whole), name
        assert np.sqrt(np.mean((running - whole) ** 2)) <= 1e-3 * np.ptp(whole), name


def test_call_by_call_is_the_same_as_all_at_once(nominal: ParameterSet) -> None:
    whole = Bench(nominal).advance(references(50.0, 300))
    piecewise = Bench(nominal)
    asked = references(50.0, 300)
    parts = [piecewise.advance(asked[k : k + 10]) for k in range(0, 300, 10)]
    for name in ("motor_speed", "shaft_torque", "armature_voltage"):
        np.testing.assert_array_equal(
            np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name)
        )


def test_time_is_the_sum_of_the_steps(nominal: ParameterSet) -> None:
    bench = Bench(nominal, step=2e-3)
    bench.advance([0.0] * 10)
    bench.advance([0.0] * 5)
    assert bench.time == pytest.approx(0.03)


def test_dead_time_holds_the_reference_back(nominal: ParameterSet) -> None:
    samples = Bench(nominal).advance([10.0] * 100)
    moving = np.flatnonzero(samples.armature_current)
    assert moving[0] == pytest.approx(63, abs=1)  # 63.947 ms after the start


def test_angles_are_the_integrals_of_the_speeds(nominal: ParameterSet) -> None:
    bench = Bench(nominal)
    first = bench.advance(references(200.0, 500))
    last = bench.advance(references(200.0, 1000)[500:])
    turned = 1e-3 * (first.motor_speed.sum() + last.motor_speed.sum())
    assert last.motor_angle == pytest.approx(turned)
    # from the middle of the gap to its driving flank, against which the drum is accelerated
    assert last.motor_angle / 62.6 - last.drum_angle == pytest.approx(0.15073, rel=0.02)


def test_driving_flank_moves_the_drum_first(nominal: ParameterSet) -> None:
    early = Bench(nominal, gap_position=1.0).advance(references(20.0, 1500))
    late = Bench(nominal, gap_position=-1.0).advance(references(20.0, 1500))
    assert np.flatnonzero(early.drum_speed)[0] + 100 < np.flatnonzero(late.drum_speed)[0]


def test_warm_shell_is_shown_at_32_degrees(nominal: ParameterSet) -> None:
    assert Bench(nominal).advance([0.0]).shell_temperature == pytest.approx(32.0 + 273.15)


def test_effect_acts_on_the_running_bench(nominal: ParameterSet) -> None:
    lagging = {"torque_sensor_lag": {"time_constant": 0.05}}
    plain = Bench(nominal).advance(references(50.0, 1000))
    shown = Bench(nominal, lagging).advance(references(50.0, 1000))
    np.testing.assert_array_equal(plain.motor_speed, shown.motor_speed)
    assert np.abs(plain.shaft_torque - shown.shaft_torque).max() > 1.0


@pytest.mark.parametrize(
    "effects", [{"gear_ghost": {"size": 1.0}}, {"torque_sensor_lag": {"tau": 1.0}}]
)
def test_unknown_effect_or_parameter_is_refused(
    nominal: ParameterSet, effects: dict[str, dict[str, float]]
) -> None:
    with pytest.raises(ParameterError, match="neither a parameter of the bench nor of an effect"):
        Bench(nominal, effects)


def test_current_is_held_to_the_limit_asked_for_and_never_above_the_drives_own(
    nominal: ParameterSet,
) -> None:
    # the motor alone takes J_m x 100 rad/s^2 / 1.85 = 7 A, with the drum behind it some 50 A; the
    # current loop stays below its reference by the back-EMF over its gain (thesis, eq. 3.3)
    steep = references(100.0, 1500)
    held, free, asked_too_much = Bench(nominal), Bench(nominal), Bench(nominal)
    held.limit_current(20.0)
    asked_too_much.limit_current(500.0)
    assert 15.0 < held.advance(steep).armature_current.max() <= 20.0
    unlimited = free.advance(steep).armature_current
    assert unlimited.max() > 25.0
    np.testing.assert_array_equal(unlimited, asked_too_much.advance(steep).armature_current)


# --- dead time ----------------------------------------------------------------------------------

LONGER = """
def dead_time(value, s, p):
    return value + p.own_size
"""


def arrival(model: Kernel, nominal: ParameterSet, longer: float) -> float:
    """When a reference that jumps at the start reaches the current [s]."""
    bench = Bench(nominal, {"own": {"size": longer}}, kernel=model)
    return 1e-3 * float(np.flatnonzero(bench.advance([10.0] * 700).armature_current)[0])


@pytest.mark.parametrize("longer", [-0.06, 0.0, 0.1, 0.4])
def test_effect_on_the_dead_time_delays_the_running_bench(
    nominal: ParameterSet, model_with: Callable[[str], Kernel], longer: float
) -> None:
    assert arrival(model_with(LONGER), nominal, longer) == pytest.approx(
        0.063947 + longer, abs=1.01e-3
    )


@pytest.mark.parametrize("longer", [0.8, -0.07, float("nan")])
def test_dead_time_that_the_running_bench_does_not_remember_is_refused(
    nominal: ParameterSet, model_with: Callable[[str], Kernel], longer: float
) -> None:
    with pytest.raises(EmulatorError, match=r"at 0 s: .* dead time.* outside of 0 to 0\.56"):
        arrival(model_with(LONGER), nominal, longer)


# --- equations without a solution ---------------------------------------------------------------

CONTRADICTION = """
def gear_torque(value, s, p):
    return value + (p.own_size if s.gear_speed > 0.1 else 0.0)
"""


def test_stages_that_do_not_settle_are_counted(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    """A torque that is there only while the gear turns without it."""
    model = model_with(CONTRADICTION)
    solved = Bench(nominal, {"own": {"size": 0.0}}, kernel=model)
    unsolved = Bench(nominal, {"own": {"size": 1e7}}, kernel=model)
    for bench in (solved, unsolved):
        bench.advance(references(20.0, 300))
    assert solved.unsettled == 0
    assert unsolved.unsettled > 0


@pytest.mark.slow
def test_bench_that_is_not_finite_any_more_is_refused(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    model = model_with("def resistance(value, s, p):\n    return value + p.own_size * float('nan')")
    bench = Bench(nominal, {"own": {"size": 1.0}}, kernel=model)
    with pytest.raises(UnsettledError, match=r"bench at .* not finite"):
        bench.advance(references(20.0, 300))
