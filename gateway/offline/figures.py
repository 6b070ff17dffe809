"""Key figures of one run on the bench, and their form as the document run/1."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gateway.arrays import Array
from gateway.offline.drive_quality import DriveQuality
from gateway.offline.evaluation import Agreement, cruise


@dataclass(frozen=True, kw_only=True)
class CruiseForce:
    """Force on the truck in steady travel [N]: the road load, and the mean error of the bench."""

    target: float
    mean_error: float


def cruise_force(
    time: Array, speed: Array, force: Array, road_load: Callable[[float], float]
) -> CruiseForce | None:
    """Force on the truck in the longest steady travel; None without such travel.

    speed : of the drum's rim [m/s]; force : of the truck at the rim [N]; shape (n,) each
    road_load : of the road at a speed [N]
    """
    steady = cruise(time, speed)
    if steady is None:
        return None
    target = float(np.mean([road_load(float(v)) for v in speed[steady]]))
    return CruiseForce(target=target, mean_error=float(force[steady].mean()) - target)


@dataclass(frozen=True, kw_only=True)
class TractionEnergy:
    """Energy that drives the truck [J]: on the road and on the bench."""

    road: float
    bench: float

    @property
    def error_percent(self) -> float | None:
        """Error of the bench [%]; None where the road takes no energy."""
        return 100.0 * (self.bench / self.road - 1.0) if self.road else None


@dataclass(frozen=True, kw_only=True)
class Latency:
    """Time from the wake-up of a tick to the end of its write [s]."""

    p50: float
    p99: float
    max: float

    @classmethod
    def of(cls, seconds: Array) -> "Latency | None":
        """Quantiles of these latencies [s], shape (n,); None where there are none."""
        if not len(seconds):
            return None
        p50, p99 = np.quantile(seconds, [0.5, 0.99])
        return cls(p50=float(p50), p99=float(p99), max=float(np.max(seconds)))


@dataclass(frozen=True, kw_only=True)
class RunFigures:
    """Key figures of one run. A figure that this run cannot show is None.

    truck_mass : with its load [kg]
    driver : who drove the truck; `recorded` or `logged` for a replay
    velocity : agreement of the two speeds, or of the two setpoints in a replay
    cycles : ticks of the run
    quality : indices of SAE J2951, of the bench over the road
    shaft_torque : least and largest [N m]; the least is negative while the motor drives
    latency : of the ticks; None where no clock ran
    stop_reason : name of the reason for which the run ended; empty: it did not end
    """

    truck_mass: float
    driver: str
    regulator: str
    velocity: Agreement | None
    force: CruiseForce | None = None
    energy: TractionEnergy | None = None
    quality: DriveQuality | None = None
    shaft_torque: tuple[float, float] | None = None
    cycles: int
    missed_deadlines: int = 0
    latency: Latency | None = None
    stop_reason: str

    def to_json(self) -> dict[str, Any]:
        """Return the figures as the document run/1."""
        velocity, force, energy, latency = self.velocity, self.force, self.energy, self.latency
        return {
            "schema": "run/1",
            "truck_kg": self.truck_mass,
            "driver": self.driver,
            "regulator": self.regulator,
            "velocity": {"val1": velocity and velocity.val1, "val2": velocity and velocity.val2},
            "force": {
                "target_newton": force and force.target,
                "mean_error_newton": force and force.mean_error,
            },
            "energy": {
                "road_joule": energy and energy.road,
                "bench_joule": energy and energy.bench,
                "error_percent": energy and energy.error_percent,
            },
            "j2951": self.quality and self.quality.to_json(),
            "shaft_torque_Nm": {
                "min": self.shaft_torque and self.shaft_torque[0],
                "max": self.shaft_torque and self.shaft_torque[1],
            },
            "cycles": self.cycles,
            "missed_deadlines": self.missed_deadlines,
            "latency_ms": {
                "p50": latency and 1e3 * latency.p50,
                "p99": latency and 1e3 * latency.p99,
                "max": latency and 1e3 * latency.max,
            },
            "stop_reason": self.stop_reason,
        }
