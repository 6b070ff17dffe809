"""Road load of the truck: rolling resistance, air drag, grade. Forces at the wheel in newtons.

There are two forms. The thesis (eq 4.10-4.12) has a rolling resistance with a part that grows with
the drum's speed. Dynamometers use F0 + F1 v + F2 v^2, which road coast-downs determine. In both
forms the weight pulls downhill in either direction of travel. The thesis prints that term under the
sign of the speed (eq 4.11), with which a truck on a slope would push itself uphill.
"""

from dataclasses import dataclass
from math import atan, copysign, cos, sin

from gateway.configuration.sections import BenchConfig, TruckConfig

GRAVITY = 9.81


@dataclass(frozen=True, kw_only=True)
class RoadLoad:
    """Coefficients of the road load.

    F = (f0 + f1 |v| + f2 v^2) sgn(v) + slope, with the speed v of the truck [m/s]

    f0 [N], f1 [N s/m], f2 [N s^2/m^2]; slope : weight along the grade [N]
    """

    f0: float
    f1: float
    f2: float
    slope: float

    def rolling(self, speed: float) -> float:
        """Resistance against the motion [N] at a speed [m/s]; 0 at rest."""
        if speed == 0.0:
            return 0.0
        v = abs(speed)
        return copysign(self.f0 + (self.f1 + self.f2 * v) * v, speed)

    def force(self, speed: float) -> float:
        """Road load [N] at a speed [m/s]; a positive load slows a truck that goes forward."""
        return self.rolling(speed) + self.slope

    @property
    def breakaway(self) -> float:
        """Force that a standing truck needs to start forward [N]."""
        return self.f0 + self.slope


def road_load(truck: TruckConfig, bench: BenchConfig) -> RoadLoad:
    """Road load of the configured truck.

    F = C_rr m g cos(gamma) + C_rr,v m g theta_d'                           (thesis, eq 4.11)

    With v = r_d theta_d' the two terms are F0 and F1. Configured F0 .. F2 are used unchanged.
    """
    gamma, weight = atan(truck.grade), truck.total_mass * GRAVITY
    slope = weight * sin(gamma)
    if truck.f0 is not None:
        return RoadLoad(f0=truck.f0, f1=truck.f1 or 0.0, f2=truck.f2 or 0.0, slope=slope)
    f1 = truck.crr_v * weight / bench.drum_radius
    return RoadLoad(f0=truck.crr * weight * cos(gamma), f1=f1, f2=0.0, slope=slope)
