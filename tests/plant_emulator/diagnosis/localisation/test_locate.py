"""Where a gap lies, on logs of the independent bench and on simulated ones with an effect."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest

from plant_emulator import parameter_sets
from plant_emulator.diagnosis.answer import Location
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.localisation.locate import WORTHWHILE_BLOCK_GAIN, gain_shares, locate
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import add_noise
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.solver.kernel import kernel

PARAMETERS = parameter_sets.load("thesis_table_3_1")
SUBSYSTEMS = {
    "drive", "motor", "motor_shaft", "gear", "backlash_shaft", "drum", "torque_sensor",
    "speed_sensor", "wheel_contact",
}  # fmt: skip


def located(*logs: Log) -> Location:
    recordings = [recording(log) for log in logs]
    model = BenchModel(recordings, PARAMETERS, kernel().effects)
    return locate(recordings, PARAMETERS, fit_null(model, range(len(recordings))))


def with_effect(inputs: Log, effects: Mapping[str, Mapping[str, float]]) -> Log:
    """The bench with drifted parameters and an effect, stepped finely, with sensors' noise."""
    values = values_of(PARAMETERS, effects)
    drift = {"gear_coulomb_friction": 1.1, "drum_inertia": 1.02, "dead_time": 0.97}
    values |= {name: factor * values[name] for name, factor in drift.items()}
    return add_noise(simulate(inputs_of(inputs), values, gap_position=0.3, step=5e-4), seed=1)


def test_equal_gains_are_equal_shares_and_a_small_one_is_little() -> None:
    shares = gain_shares({"motor": 1000.0, "torque_sensor": 1000.0, "drum": 10.0})
    assert shares["motor"] == shares["torque_sensor"] == pytest.approx(0.5, abs=1e-6)
    assert sum(shares.values()) == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["practice_002", "practice_004"])
def test_a_bench_without_an_effect_has_no_place_to_name(
    bench_log: Callable[[str], Log], case: str
) -> None:
    found = located(*(bench_log(f"bench_practice/{case}/program{k}") for k in (1, 2)))
    assert found.gain <= WORTHWHILE_BLOCK_GAIN
    assert max(found.shares.values()) < 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "programs", "subsystem"),
    [("practice_003", (1, 2), "torque_sensor"), ("practice_009", (1, 6), "gear")],
)
def test_the_independent_bench_s_faults_are_placed_where_its_label_says(
    bench_log: Callable[[str], Log], case: str, programs: tuple[int, ...], subsystem: str
) -> None:
    found = located(*(bench_log(f"bench_practice/{case}/program{k}") for k in programs))
    assert found.subsystem == subsystem
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert set(found.shares) <= SUBSYSTEMS
    assert {cell.bin for cell in found.maps["phase"]} >= {"cruise", "acceleration"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "sizes", "subsystem"),
    [
        ("motor_friction", {}, "motor"),
        ("reference_filter", {}, "drive"),
        ("drum_speed_scale", {}, "speed_sensor"),
        ("drum_bearing_friction", {}, "drum"),
    ],
)
def test_an_effect_is_placed_without_knowing_of_it(
    bench_log: Callable[[str], Log], effect: str, sizes: dict[str, float], subsystem: str
) -> None:
    own = {**kernel().effects[effect].plausible(), **sizes}
    logs = [
        replace(with_effect(bench_log(f"bench_nominal/program{k}"), {effect: own}), source=f"{k}")
        for k in (1, 2)
    ]
    found = located(*logs)
    assert found.gain > WORTHWHILE_BLOCK_GAIN
    assert found.subsystem == subsystem
