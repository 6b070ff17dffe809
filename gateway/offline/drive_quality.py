"""The indices of SAE J2951 of a run: the bench over the road (pure).

Both speeds are taken at 10 Hz and smoothed by two means of five points; a speed up to 0.03 m/s is
standstill. The filter belongs to the definition: without it the inertia work is several percent
higher. With the force F = F_RL(v) + m a and w = sum of max(F, 0) v dt

    ER = w_bench / w_road - 1,  DR the same of the distances,  EER = 1 - (DR + 1) / (ER + 1)

ASCR compares sum |a| dt, IWR sum of max(m a, 0) v dt. RMSSE is the rms of the difference of the
speeds. The definitions follow a public implementation; the standard itself was not read. The work
of braking, which a truck recuperates, stands beside them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from gateway.arrays import Array
from register_maps.units import KMH

PERIOD: Final = 0.1
POINTS: Final = 5
RIM_STANDSTILL: Final = 0.03
"""[m/s]"""
SHORTEST_TRACE: Final = 1.0
"""[s] A shorter run has no indices."""


@dataclass(frozen=True, kw_only=True)
class DriveQuality:
    """Indices of a run; ratings as shares [1].

    energy, distance, economy, speed_change, inertia_work : ER, DR, EER, ASCR, IWR
    speed_error : RMSSE [m/s]
    braking_on_road, braking_on_bench : work of braking [J]
    """

    energy: float
    distance: float
    economy: float
    speed_change: float
    inertia_work: float
    speed_error: float
    braking_on_road: float
    braking_on_bench: float

    def to_json(self) -> dict[str, Any]:
        """Return the indices, ratings in percent, RMSSE in km/h."""
        return {
            "er_percent": 100.0 * self.energy,
            "dr_percent": 100.0 * self.distance,
            "eer_percent": 100.0 * self.economy,
            "ascr_percent": 100.0 * self.speed_change,
            "iwr_percent": 100.0 * self.inertia_work,
            "rmsse_km_h": self.speed_error / KMH,
            "braking_road_joule": self.braking_on_road,
            "braking_bench_joule": self.braking_on_bench,
        }

    def __str__(self) -> str:
        return (
            f"IWR {100.0 * self.inertia_work:+.2f} %  RMSSE {self.speed_error / KMH:.3f} km/h  "
            f"ER {100.0 * self.energy:+.2f} %  DR {100.0 * self.distance:+.2f} %"
        )


def drive_quality(
    time: Array,
    road_speed: Array,
    bench_speed: Array,
    mass: float,
    road_load: Callable[[float], float],
) -> DriveQuality | None:
    """Indices of a run; None where it is too short, or where the truck does not move on the road.

    time [s], speeds [m/s], shape (n,) each; mass : of the truck [kg]
    road_load : of the road at a speed [N]
    """
    if len(time) < 2 or time[-1] - time[0] < SHORTEST_TRACE:
        return None
    moments = np.arange(time[0], time[-1], PERIOD)
    road, bench = (smooth(np.interp(moments, time, one)) for one in (road_speed, bench_speed))
    return None if not road.any() else indices(PERIOD, road, bench, mass, road_load)


def smooth(speed: Array) -> Array:
    """Speed after two means of five points, fewer at the ends; at rest 0 [m/s]. Shape (n,)."""
    window = np.ones(POINTS)
    count = np.convolve(np.ones_like(speed), window, mode="same")
    for _ in range(2):
        speed = np.convolve(speed, window, mode="same") / count
    return np.where(np.abs(speed) <= RIM_STANDSTILL, 0.0, speed)


def indices(
    period: float, road: Array, bench: Array, mass: float, road_load: Callable[[float], float]
) -> DriveQuality:
    """Indices of two smoothed speeds [m/s], one value each `period` [s], shape (n,) each."""
    on_road = _sums(period, road, mass, road_load)
    on_bench = _sums(period, bench, mass, road_load)
    pairs = zip(on_bench[:4], on_road[:4], strict=True)
    energy, distance, change, inertia = (
        found / wanted - 1.0 if wanted else np.nan for found, wanted in pairs
    )
    return DriveQuality(
        energy=energy,
        distance=distance,
        economy=1.0 - (distance + 1.0) / (energy + 1.0),
        speed_change=change,
        inertia_work=inertia,
        speed_error=float(np.sqrt(np.mean((bench - road) ** 2))),
        braking_on_road=on_road[4],
        braking_on_bench=on_bench[4],
    )


def _sums(
    period: float, speed: Array, mass: float, road_load: Callable[[float], float]
) -> tuple[float, ...]:
    """Driving work [J], distance [m], change of speed [m/s], inertia and braking work [J]."""
    acceleration = np.gradient(speed, period)
    load = np.array([road_load(float(v)) if v else 0.0 for v in speed])
    force, way = load + mass * acceleration, speed * period
    return tuple(
        float(np.sum(one))
        for one in (
            np.maximum(force, 0.0) * way,
            way,
            np.abs(acceleration) * period,
            np.maximum(mass * acceleration, 0.0) * way,
            np.maximum(-force, 0.0) * way,
        )
    )
