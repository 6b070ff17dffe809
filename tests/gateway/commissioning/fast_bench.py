"""A program on the emulated bench without clock and socket: its samples for the checks."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gateway.commissioning.step_run import OUTSIDE, StepRun
from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.losses.sections import SweepTrace
from plant_emulator import effects
from plant_emulator.emulator.plc.plc import Plc
from plant_emulator.emulator.plc.surroundings import Backlash
from plant_emulator.simulation.running_bench import Bench
from register_maps.signals import Measurement
from tests.gateway.closed_loop import PARAMETERS, ClosedLoop


@dataclass
class FastBench(ClosedLoop):
    """The bench without a truck; factors : of parameters of the bench; hidden : its effects."""

    factors: dict[str, float] = field(default_factory=dict)
    hidden: Sequence[str] = ()
    samples: list[Measurement] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        changed = {name: share * PARAMETERS.value(name) for name, share in self.factors.items()}
        self.plc = Plc(
            Bench(PARAMETERS.with_values(changed), effects.parse(self.hidden)),
            self.map,
            backlash=Backlash(ratio=62.6, half_gap=0.15073),
        )

    def tick(self, measurement: Measurement) -> None:
        before = self.state.regulator
        super().tick(measurement)
        runs = self.last.state is State.RUN and before is not None
        self.samples.append(measurement)
        self.steps.append(before.number if runs else OUTSIDE)

    def drive(self) -> StepRun:
        """Run the program of the configuration to its end."""
        self.start()
        while not self.last.finished:
            self.run(0.1)
            assert self.last.state is State.RUN, self.last
        return step_run(self.config, self.samples, self.steps)


def step_run(config: Config, samples: Sequence[Measurement], steps: Sequence[int]) -> StepRun:
    """Samples of the bench as the checks take them."""
    columns = {
        name: np.array([getattr(one, name) for one in samples])
        for name in (
            *("plc_time", "motor_speed", "drum_speed", "armature_current"),
            *("shaft_torque", "shaft_torque_integral", "plc_heartbeat"),
        )
    }
    time, integral = columns["plc_time"], columns["shaft_torque_integral"]
    mean = np.diff(integral) / np.diff(time)
    trace = SweepTrace(
        name="fast bench",
        time=time,
        motor_speed=columns["motor_speed"],
        drum_speed=columns["drum_speed"],
        shaft_torque=np.concatenate((columns["shaft_torque"][:1], mean)),
    )
    return StepRun(
        config=config,
        trace=trace,
        current=columns["armature_current"],
        own_time=time,
        heartbeat=columns["plc_heartbeat"],
        oil_temperature=np.full(len(time), np.nan),
        steps=np.array(steps),
    )
