"""One truck's cycle on the emulated bench beside its cycle on the road: figures and curves."""

from dataclasses import dataclass

import numpy as np

from gateway.arrays import Array
from gateway.cycle.supervisor import State
from gateway.demo.options import DemoOptions
from gateway.demo.plot import Curves
from gateway.offline.drive_quality import drive_quality
from gateway.offline.evaluation import Agreement, agreement, traction_energy
from gateway.offline.figures import Latency, RunFigures, TractionEnergy, cruise_force
from gateway.recordings.recording import GatewayRecording
from plant_emulator.signals.log import Log
from plant_emulator.simulation import truck


@dataclass(frozen=True, kw_only=True)
class BenchRun:
    """One truck's cycle in SI, shape (n,) each.

    log : of the emulated bench, time from the start of the cycle
    recording, exit_code : what the gateway left behind
    road_speed : of the same truck on the road [m/s]
    road_force : of the truck's drive on the road [N]
    """

    truck: truck.Forklift
    log: Log
    recording: GatewayRecording
    exit_code: int
    road_speed: Array
    road_force: Array

    @property
    def speed(self) -> Array:
        """Speed of the drum's rim [m/s]."""
        return self.log["drum_speed"] * self.truck.drum_radius

    @property
    def force(self) -> Array:
        """Force of the truck at the rim [N]; it acts up to its sample."""
        return self.log["wheel_torque"] / self.truck.wheel_radius


def drive_on_road(options: DemoOptions, forklift: truck.Forklift, log: Log) -> tuple[Array, Array]:
    """Speed [m/s] and drive force [N] of the truck of a log on the road.

    Without a driver, the truck has the torque that acted on the bench. A driver asks for other
    torques where the bench gives him other speeds, so that he drives on the road as well.
    """
    if options.driver == "none":
        speed = truck.road_speed(forklift, log.time, log["wheel_torque"])
        return speed, log["wheel_torque"] / forklift.wheel_radius
    driver = truck.driver_of(options.driver, forklift)
    speed, torque = truck.drive_on_road(driver, forklift, log.time)
    return speed, torque / forklift.wheel_radius


def figures_of(options: DemoOptions, run: BenchRun) -> RunFigures:
    """Key figures of one run. The latency is not measured where no clock ran."""
    ticks = run.recording.records[run.recording.records["state"] == State.RUN]
    return RunFigures(
        truck_mass=run.truck.mass,
        driver=options.driver,
        regulator=options.regulator,
        velocity=agreement(run.road_speed, run.speed),
        force=cruise_force(run.log.time, run.speed, run.force, run.truck.road_load),
        energy=TractionEnergy(
            road=traction_energy(run.log.time, run.road_force, run.road_speed),
            bench=traction_energy(run.log.time, run.force, run.speed),
        ),
        quality=drive_quality(
            run.log.time, run.road_speed, run.speed, run.truck.mass, run.truck.road_load
        ),
        shaft_torque=(float(run.log["shaft_torque"].min()), float(run.log["shaft_torque"].max())),
        cycles=len(ticks),
        missed_deadlines=int(ticks["missed"][-1] - ticks["missed"][0]) if len(ticks) else 0,
        latency=None if options.fast else Latency.of(ticks["latency"]),
        stop_reason=run.recording.stop_reason(),
    )


def curves_of(run: BenchRun, title: str, close: Agreement | None) -> Curves:
    """What the picture shows of one run; close : agreement of the speeds."""
    return Curves(
        title=title,
        note=f"Val1 {close.val1:.1f} %   Val2 {close.val2:.1f} %" if close else "",
        time=run.log.time,
        road_speed=run.road_speed,
        bench_speed=run.speed,
        wheel_force=run.force,
        road_load=np.array([run.truck.road_load(float(v)) for v in run.road_speed]),
        shaft_torque=run.log["shaft_torque"],
        motor_setpoint=run.log["speed_reference"],
        motor_speed=run.log["motor_speed"],
    )
