"""A loss by load against torque balances by hand and logs of another implementation."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.simulation.start_in_gap import fit_start, mean_square_residual
from tests.plant_emulator.model.test_plant import energy
from tests.plant_emulator.runs import GEAR, Piecewise, linear, simulate

SHARE, DIFFERENCE = "load_dependent_gear_loss_share", "load_dependent_gear_loss_difference"
LOSS = {SHARE: 0.1}
# What a torque at the truck's wheel is at the drum: radii of 0.645 and 0.1715 m.
AT_DRUM = 0.645 / 0.1715
# How far the drifted parameters of practice_009 lie from the table [%], from its label.
DRIFT = {
    "gear_viscous_friction": 1.3319, "gear_coulomb_friction": 7.7404,
    "gear_friction_exponent": 0.3279, "drum_inertia": 0.1284, "drum_shaft_damping": 4.7732,
    "backlash_half_gap": 4.3135, "dead_time": -3.1484, "flux_constant_1": -0.3256,
    "flux_constant_2": -6.1893,
}  # fmt: skip


def table(omega: float) -> float:
    """Friction of the table at a speed of the gear output [N m]."""
    return 35.989 + 345.38 * abs(omega) ** 0.4418


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(
    ("power", "wheel_torque", "difference", "through_gear"),
    [
        ("driving", -100.0, 0.0, 1.1 * 100.0 * AT_DRUM),
        ("driven back", 100.0, 0.0, -0.9 * 100.0 * AT_DRUM),
        ("driving", -100.0, 0.5, 1.15 * 100.0 * AT_DRUM),
        ("driven back", 100.0, 0.5, -0.95 * 100.0 * AT_DRUM),
    ],
)
def test_motor_side_gives_more_and_receives_less_than_the_drum_side(
    nominal: ParameterSet,
    direction: float,
    power: str,
    wheel_torque: float,
    difference: float,
    through_gear: float,
) -> None:
    """(1 + a (1 + d)) T_gd while the motor drives, (1 - a (1 - d)) |T_gd| while the drum does."""
    bench = Piecewise({**nominal.values(), **LOSS, DIFFERENCE: difference})
    bench.to(2.0, direction * 120.0)
    bench.to(30.0, direction * 120.0, wheel_torque=direction * wheel_torque)
    torque = -62.6 * bench.to(31.0, direction * 120.0, wheel_torque=direction * wheel_torque)[-1, 3]
    assert direction * torque == pytest.approx(table(120.0 / 62.6) + through_gear, rel=1e-4), power


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("difference", "share_driven"), [(0.0, 0.1), (0.8, 0.02)])
def test_gear_at_rest_holds_its_load_with_the_load_itself(
    nominal: ParameterSet, direction: float, difference: float, share_driven: float
) -> None:
    """The drum alone pushes: T_gd = f_gc + a (1 - d) T_gd where it moves the gear."""
    values = {**nominal.values(), **LOSS, DIFFERENCE: difference}
    bench = Piecewise(values, gap_position=-direction)
    for k in range(1, 4001):
        bench.to(5e-3 * k, 0.0, wheel_torque=direction * 3e-3 * k)
        if bench.x[GEAR] != 0.0:
            assert np.sign(bench.x[GEAR]) == direction
            assert 3e-3 * k * AT_DRUM == pytest.approx(35.989 / (1.0 - share_driven), rel=0.01)
            return
    raise AssertionError("the gear did not move")


@pytest.mark.parametrize("difference", [0.0, 0.9])
def test_mirrored_reference_gives_mirrored_run(nominal: ParameterSet, difference: float) -> None:
    corners = ((0.1, 0.0), (1.0, 150.0), (1.5, 150.0), (2.5, -120.0), (3.5, 0.0))
    values = {**nominal.values(), **LOSS, DIFFERENCE: difference}
    run = simulate(linear(*corners, duration=5.0), values)
    other = simulate(linear(*((t, -w) for t, w in corners), duration=5.0), values)
    for name in ("motor_speed", "drum_speed", "armature_current", "shaft_torque"):
        np.testing.assert_array_equal(run[name], -other[name])


@settings(max_examples=20, deadline=None)
@given(
    speeds=st.tuples(*[st.floats(-2.0, 2.0)] * 2),
    gap=st.floats(-0.155, 0.155),
    share=st.sampled_from([0.05, 0.5]),
    difference=st.sampled_from([-0.9, 0.0, 0.9]),
)
def test_free_bench_only_loses_energy(
    nominal: ParameterSet,
    speeds: tuple[float, float],
    gap: float,
    share: float,
    difference: float,
) -> None:
    values = {**nominal.values(), SHARE: share, DIFFERENCE: difference}
    bench = Piecewise({**values, "voltage_limit": 1e-12})
    bench.x[:8] = [0.0, 0.0, 0.0, 62.6 * speeds[0], 0.0, speeds[0], gap, speeds[1]]
    before = first = energy(bench.x)
    for k in range(1, 61):
        bench.to(0.01 * k, 0.0)
        now = energy(bench.x)
        assert now <= before + 1e-12 * (first + 1.0)
        before = now


@pytest.mark.parametrize(("share", "difference"), [(0.05, 0.0), (0.5, 0.0), (0.5, 0.9)])
def test_running_bench_settles_through_a_reversal(
    nominal: ParameterSet, share: float, difference: float
) -> None:
    loss = {"share": share, "difference": difference}
    bench = Bench(nominal, {"load_dependent_gear_loss": loss})
    bench.advance([30.0 * np.sin(4e-3 * k) for k in range(4000)])
    assert bench.unsettled == 0


@pytest.mark.slow
@pytest.mark.parametrize(("program", "without"), [("program1", 7.0), ("program6", 20.0)])
def test_loss_of_an_independent_bench_is_told_to_the_noise(
    nominal: ParameterSet, bench_log: Callable[[str], Log], program: str, without: float
) -> None:
    """practice_009: 0.14 of |T_gd|; program 6 has a truck that also brakes.

    The truck's torque is logged with noise, which adds 0.04 to program 6.
    """
    log = bench_log(f"bench_practice/practice_009/{program}")
    run, values = inputs_of(log), nominal.values()
    values |= {key: (1.0 + percent / 100.0) * values[key] for key, percent in DRIFT.items()}
    lossy = {**values, SHARE: 0.14}
    start = fit_start(log, run, lossy)

    def misfit(of: dict[str, float]) -> float:
        return mean_square_residual(log, simulate(log, of, gap_position=start))

    assert misfit(lossy) < 1.06
    assert misfit(values) > without
