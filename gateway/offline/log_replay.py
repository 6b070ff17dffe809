"""Replay of a log through the tick: which setpoint would the gateway have asked for (pure)?

The tick gets the samples as the PLC would have sent them, after a second at rest in which the
operator switches remote on. So supervisor, regulator and limits work as on the bench. The torque
integral is that of the logged torque, linear between samples.

The loop is open: the logged bench followed the reference in the log and not the replay's setpoint,
so that a difference in speed integrates. Only the two setpoints can be compared.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.arrays import Array
from gateway.configuration.config import Config
from gateway.cycle.checks import ALL_CLOSED
from gateway.cycle.cycle import Observation, Output, initial, step
from gateway.cycle.supervisor import State
from register_maps.register_map import RegisterMap
from register_maps.signals import Alarm, Measurement, PlcState, Status

RESTING_TIME: Final = 1.0
"""[s] Rest before the log: half of it with remote off, so that the operator then switches it on."""
STANDING: Final = Status.READY | Status.WARM | Status.WATCHDOG_OK | Status.EMERGENCY_STOP_OK
RUNNING: Final = Status.ENABLED | Status.ROAD_LOAD


def replay(
    config: Config, register_map: RegisterMap, time: Array, columns: Mapping[str, Array]
) -> list[Output]:
    """Put every sample of a log through the tick; return one output a sample.

    time [s], columns by signal in SI, shape (n,) each
    """
    state = initial(config, register_map)
    running, outputs = False, []
    for measurement, remote in _samples(time, columns):
        status = STANDING | (Status.REMOTE if remote else 0) | (RUNNING if running else 0)
        plc_state = PlcState.ROAD_LOAD if running else PlcState.READY
        seen = replace(measurement, status=status, plc_state=plc_state)
        observation = Observation(now=measurement.plc_time, measurement=seen)
        state, output = step(config, register_map, state, observation)
        running = output.state in (State.RUN, State.RAMPDOWN)
        outputs.append(output)
    return outputs[-len(time) :]


def _samples(times: Array, columns: Mapping[str, Array]) -> Iterator[tuple[Measurement, bool]]:
    """Measurements that the PLC would have sent, and whether remote was on."""
    step_size = float(np.median(np.diff(times)))
    resting = max(4, round(RESTING_TIME / step_size))
    integral, before, last = 0.0, 0.0, 0.0
    for index in range(-resting, len(times)):
        row = {name: float(column[max(index, 0)]) for name, column in columns.items()}
        torque = row["shaft_torque"]
        time = float(times[index]) if index >= 0 else float(times[0]) + index * step_size
        mean = 0.5 * (torque + before) if index > -resting else torque
        integral += mean * (time - last) if index > -resting else 0.0
        last, before = time, torque
        yield _measurement(row, index + resting, time, mean, integral), index >= -resting // 2


def _measurement(
    row: dict[str, float], number: int, time: float, mean: float, integral: float
) -> Measurement:
    return Measurement(
        sequence_start=number,
        sequence_end=number,
        plc_heartbeat=number,
        plc_time=time,
        status=STANDING,
        alarm=Alarm(0),
        interlock=ALL_CLOSED,
        motor_speed=row["motor_speed"],
        drum_speed=row["drum_speed"],
        shaft_torque=row["shaft_torque"],
        shaft_torque_mean=mean,
        shaft_torque_integral=integral,
        speed_reference=row["speed_reference"],
        armature_current=row.get("armature_current"),
        armature_voltage=row.get("armature_voltage"),
        shell_temperature_1=row.get("shell_temperature"),
    )
