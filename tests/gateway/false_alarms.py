"""False alarms of the plausibility in many hours: drives of drifted benches, noise drawn anew.

    python -m tests.gateway.false_alarms 401 420 360 500

drives the benches of these seeds for 360 s each, with noisy sensors, and keeps what the sensors
would show without their noise. Then it draws the noise 500 times for every drive, and sums the
residuals up again. That makes 1000 hours of sound sensors on 20 drifted benches. The sums are
written anew with NumPy, many draws at once; tests/gateway/test_false_alarms.py compares them with
the daemon's own. The regulator has seen the noise of the drive, not the drawn one.
"""

import sys
from dataclasses import dataclass

import numpy as np

from gateway.cycle.plausibility import ENVELOPE, PULSES, REACTION, RISE, SMOOTHING_TIME
from gateway.cycle.supervisor import State
from gateway.cycle.tolerances import Params
from gateway.friction.law import friction_torque
from gateway.reasons import Reason
from plant_emulator.simulation.sensor_noise import SENSORS
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop, Reading
from tests.gateway.drifted_bench import sound_drive

SIGMA = {name: SENSORS[name][0] for name in ("motor_speed", "drum_speed", "armature_current")}
SIGMA["torque"] = SENSORS["shaft_torque"][0] / np.sqrt(10.0)
"""Deviation of one sample; the PLC's mean torque has ten samples."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Samples of a drive, one a scan, each of shape (n,), as the gateway decodes them.

    torque : mean of the window that ends at the sample [N m]
    """

    motor_speed: np.ndarray
    drum_speed: np.ndarray
    armature_current: np.ndarray
    torque: np.ndarray


def drive(loop: ClosedLoop, duration: float) -> Drive:
    """Samples of a running loop over a duration [s], without their noise.

    Raises AssertionError for a trip.
    """
    rows, noise = [], loop.disturb

    def kept(one: ClosedLoop, reading: Reading) -> Reading:
        assert not isinstance(reading, Reason)
        current, torque = reading.armature_current, reading.shaft_torque_mean
        rows.append((reading.motor_speed, reading.drum_speed, current, torque))
        return noise(one, reading)

    loop.disturb = kept
    for _ in range(round(duration / SCAN)):
        loop.run(SCAN)
        assert loop.last.state is State.RUN, (loop.last.reason, loop.plc.time)
        loop.observations.clear()
        loop.outputs[:-1] = []
    return Drive(**dict(zip(Drive.__annotations__, np.array(rows, float).T, strict=True)))


def shares(p: Params, found: Drive, draws: int, seed: int) -> np.ndarray:
    """Largest sums of motor, gear and drum over their alarm levels, shape (draws, 3)."""
    random = np.random.default_rng(seed)
    sums, largest = np.zeros((6, draws)), np.zeros((3, draws))
    levels = np.array([p.motor_level, p.gear_level, p.drum_level])[:, None]
    mean = envelope = acceleration = np.zeros(draws)
    before = None
    for k in range(len(found.torque)):
        noise = random.standard_normal((4, draws))
        motor = found.motor_speed[k] + SIGMA["motor_speed"] * noise[0]
        drum = found.drum_speed[k] + SIGMA["drum_speed"] * noise[1]
        current = found.armature_current[k] + SIGMA["armature_current"] * noise[2]
        torque = found.torque[k] + SIGMA["torque"] * noise[3]
        flux = np.minimum(p.flux_constant, p.flux_constant_1 / (p.flux_constant_2 + abs(motor)))
        last = flux * current
        if before is not None:
            motor_0, drum_0, last_0 = before
            mean = last + (mean - last) * np.exp(-SCAN / SMOOTHING_TIME)
            envelope = np.maximum(envelope * np.exp(-SCAN / ENVELOPE), abs(mean))
            rise = (motor - motor_0) / SCAN
            acceleration = rise + (acceleration - rise) * np.exp(-SCAN / RISE)
            share = p.torque_share + REACTION * envelope / p.full_torque
            middle = (motor_0 + motor) / (2.0 * p.gear_ratio)
            friction = friction_torque(found.motor_speed[k] / p.gear_ratio, p.regulator.friction)
            residuals = SCAN * np.array(
                [
                    (last_0 + last) / 2.0 + torque - p.motor_inertia * rise,
                    middle - (drum_0 + drum) / 2.0,
                    p.drum_inertia * (drum - drum_0) / SCAN + p.gear_ratio * torque + friction,
                ]
            )
            tolerances = SCAN * np.array(
                [
                    p.torque + share * envelope + p.stairs + PULSES * abs(acceleration),
                    p.speed + p.speed_share * np.maximum(abs(middle), abs(drum)),
                    np.full(draws, p.truck_torque),
                ]
            )
            growth = np.concatenate((residuals - tolerances, -residuals - tolerances))
            sums = np.maximum(sums + growth, 0.0)
            largest = np.maximum(largest, np.maximum(sums[:3], sums[3:]) / levels)
        before = (motor, drum, last)
    return largest.T


def main(first: int, last: int, seconds: int, draws: int) -> None:
    """Print the largest shares of each bench, and the alarms of all of them."""
    alarms, hours = 0, (last - first + 1) * seconds * draws / 3600.0
    for seed in range(first, last + 1):
        loop = sound_drive(seed)
        found = shares(loop.state.watched.relations, drive(loop, seconds), draws, seed + 3000)
        alarms += int((found > 1.0).any(axis=1).sum())
        print(seed, found.max(axis=0).round(2), flush=True)
    print(f"{alarms} alarms in {hours:g} hours on {last - first + 1} drifted benches")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
