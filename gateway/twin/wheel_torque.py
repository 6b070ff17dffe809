"""The wheel torque of the truck of a recorded run, from the sensors and the model of the bench.

    T_w = r_w / r_d ((J_g + J_d) theta_d'' + T_f + xi T_meas)               (thesis, eq 4.9)

Nobody measures this torque on a bench. It is known as well as the parameter set.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from gateway.arrays import Array
from gateway.configuration.config import Config
from gateway.errors import GatewayError
from gateway.offline.evaluation import road_speed
from gateway.offline.recording_replay import observations
from gateway.offline.truck_torque import truck_torques
from gateway.physics.road_load import road_load
from gateway.physics.window import Window
from gateway.recordings.recording import GatewayRecording
from plant_emulator.simulation.truck import PARKED_TORQUE
from register_maps.register_map import RegisterMap
from register_maps.timing import SCAN

SMOOTHING_SAMPLES: Final = 11
"""Scans of the centred mean: the drum's acceleration is noisy, its integral is not."""
STANDING_DRUM, STANDING_GEAR = 0.02, 0.005
"""[rad/s] Speeds of drum and gear output below which the truck stands."""
STANDING_TREAD: Final = 0.02
"""[m/s] Speed of the tread below which a truck is held by its brake."""


@dataclass(frozen=True, kw_only=True)
class RecordedTorque:
    """Driver that gives a recorded torque, one value a scan [N m]; NaN: the truck is parked.

    A truck that comes to its stop later than the recorded one brakes on as that one did last.
    """

    torque: Array

    @cached_property
    def on_the_move(self) -> Array:
        """Torque on a truck that moves [N m]: where the recorded one is parked, its last brake."""
        known = np.where(np.isfinite(self.torque), np.arange(len(self.torque)), -1)
        index = np.maximum.accumulate(known)
        last = np.where(index < 0, 0.0, self.torque[index])
        return np.where(known < 0, np.minimum(last, 0.0), last)

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        """Drive and brake torque at the wheel [N m]; a negative torque is that of the brake."""
        index = min(round(time / SCAN), len(self.torque) - 1)
        if np.isnan(self.torque[index]) and speed < STANDING_TREAD:
            return 0.0, PARKED_TORQUE
        value = float(self.on_the_move[index])
        return max(value, 0.0), max(-value, 0.0)

    def samples_within(self, config: Config) -> int:
        """Number of scans until this torque drives a truck on the road faster than the bench may.

        config : truck, road and the limit of the speed
        """
        truck, bench, scans = config.truck, config.bench, len(self.torque)
        fastest = config.limits.speed_max / bench.gear_ratio * bench.drum_radius
        force = self.on_the_move / truck.wheel_radius
        road = road_load(truck, bench).force
        speed = road_speed(SCAN * np.arange(scans, dtype=np.float64), force, truck.total_mass, road)
        faster = np.flatnonzero(speed > fastest)
        return int(faster[0]) if len(faster) else scans


def wheel_torque(found: GatewayRecording, config: Config, register_map: RegisterMap) -> Array:
    """Torque of the truck at its wheel in each scan since it set off [N m]; NaN: it stands.

    config : that of the run, with the friction of the parameter set

    Raises GatewayError for a recording without a run in road load.
    """
    lever = config.truck.wheel_radius / config.bench.drum_radius
    ends, torques, standing = [0.0], [0.0], [True]
    seen = observations(found.rows(), register_map)
    states = found.records["state"]
    for window, torque in truck_torques(seen, states, config, register_map):
        ends.append(ends[-1] + window.duration)
        torques.append(lever * torque)
        standing.append(_stands(window, config.bench.gear_ratio))
    if len(ends) < SMOOTHING_SAMPLES:
        raise GatewayError("no run in road load: there is no truck whose torque could be known")
    middles = np.arange(round(ends[-1] / SCAN)) * SCAN + SCAN / 2
    at = np.minimum(np.searchsorted(ends, middles), len(ends) - 1)
    smooth = np.convolve(
        np.array(torques)[at], np.full(SMOOTHING_SAMPLES, 1.0 / SMOOTHING_SAMPLES), mode="same"
    )
    return np.where(np.array(standing)[at], np.nan, smooth)


def _stands(window: Window, ratio: float) -> bool:
    return (
        abs(window.drum_speed) < STANDING_DRUM and abs(window.motor_speed) < STANDING_GEAR * ratio
    )
