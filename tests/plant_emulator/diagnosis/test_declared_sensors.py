"""A lag that the parameter set declares is no gap; one that nobody declared is found."""

from dataclasses import replace

import pytest

from plant_emulator import effects
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.sensors import Sensor
from plant_emulator.workflows.diagnosis.diagnose import diagnose
from plant_emulator.workflows.simulation import simulate

pytestmark = pytest.mark.slow
LAG = {"torque_sensor_lag": {"time_constant": 0.05}}
# What a lag of the torque could be taken for. Practice logs are diagnosed with the whole library.
LIBRARY = {"torque_sensor_lag", "torque_sensor_gain", "torque_sensor_offset", "shaft_damping"}
LEFT_OUT = sorted({*effects.names()} - LIBRARY)


@pytest.mark.parametrize(("declared", "named"), [(0.05, ()), (None, ("torque_sensor_lag",))])
def test_a_lag_of_the_torque_is_a_gap_only_where_nobody_declared_it(
    nominal: ParameterSet, declared: float | None, named: tuple[str, ...]
) -> None:
    """The solver itself lags the torque of the logs; the declared lag follows the samples."""
    sensors = {} if declared is None else {"shaft_torque": Sensor(time_constant=declared)}
    logs = [
        replace(simulate(f"program{k}", effects=LAG, seed=k), source=f"run {k}") for k in (1, 2)
    ]
    parameters = replace(nominal, sensors=sensors)
    verdict = diagnose(logs, parameters=parameters, without=LEFT_OUT).answer.verdict
    assert verdict.effects == named
    assert verdict.kind == ("effect" if named else "none")
