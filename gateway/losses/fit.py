"""Fit of the friction law to the steady stretches of a run, with standard errors (pure).

    T_f = f_gc + f_g omega^delta_g                                          (thesis, eq 3.27)

Two of the three parameters are linear: for any exponent they follow from weighted least squares. So
only the exponent is searched, on a grid over its whole range and then by golden section. Standard
errors follow from the curvature at the optimum. They grow with the residuals where these are larger
than the scatter of the torque explains.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gateway.arrays import Array
from gateway.friction.document import RANGES
from gateway.friction.law import Friction
from gateway.losses.sections import LossesError, Section

FEWEST_SECTIONS: Final = 4
"""Least count of speeds: one more than the law has parameters, so that residuals remain."""
SAME_SPEED_RATIO: Final = 1.05
"""Ratio from which two speeds count as two."""
SPREAD: Final = 2.5
"""Least ratio of fastest and slowest speed, which separates exponent and constant part."""
EXPONENT_ERROR: Final = 0.15
"""Standard error above which the exponent counts as not determined."""
RESOLUTION: Final = 0.01
"""[N m] Resolution of the friction at the gear output; a smaller scatter gives no more weight."""
GOLDEN: Final = (np.sqrt(5.0) - 1.0) / 2.0
GRID: Final = np.linspace(*RANGES["exponent"], 196)


@dataclass(frozen=True, kw_only=True)
class FrictionFit:
    """The fitted friction law.

    covariance : of coulomb, viscous, exponent [their units], shape (3, 3); zero for a held one
    residuals : friction of each section minus friction of the law [N m], shape (n,)
    held_at_zero : the constant part would have been negative and is held at 0
    slowest, fastest : of the sections, at the gear output [rad/s]
    """

    friction: Friction
    covariance: Array = field(repr=False)
    residuals: Array = field(repr=False)
    held_at_zero: bool
    slowest: float
    fastest: float

    @property
    def standard_errors(self) -> tuple[float, float, float]:
        """Standard errors of coulomb [N m], viscous [N m (s/rad)^exponent] and exponent [1]."""
        coulomb, viscous, exponent = np.sqrt(np.diag(self.covariance))
        return float(coulomb), float(viscous), float(exponent)

    def torque(self, omega: Array) -> Array:
        """Friction [N m] at speeds of the gear output [rad/s], shape (n,) each."""
        law = self.friction
        return law.coulomb + law.viscous * omega**law.exponent

    def torque_error(self, omega: Array) -> Array:
        """Standard error of the friction [N m] at speeds of the gear output [rad/s]."""
        slopes = _slopes(omega, self.friction.viscous, self.friction.exponent)
        error: Array = np.sqrt(np.einsum("ki,ij,kj->k", slopes, self.covariance, slopes))
        return error


def fit(sections: Sequence[Section]) -> FrictionFit:
    """Fit the friction law. Raises LossesError where these sections do not determine it."""
    omega = np.array([one.gear_speed for one in sections])
    torque = np.array([one.friction for one in sections])
    weight = 1.0 / (np.array([one.standard_error for one in sections]) ** 2 + RESOLUTION**2)
    _refuse_too_few(omega)
    exponent = _search(omega, torque, weight)
    coulomb, viscous = _linear(exponent, omega, torque, weight)
    residuals = torque - (coulomb + viscous * omega**exponent)
    _refuse_edge(exponent, viscous, omega)
    covariance = _covariance(omega, weight, residuals, (coulomb, viscous, exponent))
    error = float(np.sqrt(covariance[2, 2]))
    if error > EXPONENT_ERROR:
        raise LossesError(
            f"the exponent of the friction is not determined: {exponent:.2f} with a standard error "
            f"of {error:.2f} from {_range(omega)}; expected at most {EXPONENT_ERROR:g}: longer "
            "stretches, or slower and faster ones"
        )
    return FrictionFit(
        friction=Friction(coulomb=coulomb, viscous=viscous, exponent=exponent),
        covariance=covariance,
        residuals=residuals,
        held_at_zero=coulomb == 0.0,
        slowest=float(omega.min()),
        fastest=float(omega.max()),
    )


def count_speeds(speeds: Iterable[float]) -> int:
    """Count of different speeds [rad/s]; speeds within a ratio of SAME_SPEED_RATIO count as one."""
    counted, last = 0, 0.0
    for one in sorted(speeds):
        if one > SAME_SPEED_RATIO * last:
            counted, last = counted + 1, one
    return counted


def _refuse_too_few(omega: Array) -> None:
    speeds = count_speeds(omega)
    if speeds < FEWEST_SECTIONS:
        raise LossesError(
            f"too few steady speeds, found {speeds}; expected at least {FEWEST_SECTIONS}, "
            "each held for a few seconds without a truck"
        )
    if omega.max() < SPREAD * omega.min():
        raise LossesError(
            f"the steady speeds are too close to each other, found {_range(omega)}; expected the "
            f"fastest at least {SPREAD:g} times the slowest, or the exponent is not determined"
        )


def _refuse_edge(exponent: float, viscous: float, omega: Array) -> None:
    low, high = RANGES["exponent"]
    if viscous <= 0.0:
        raise LossesError(
            f"the friction does not rise with the speed over {_range(omega)}; expected "
            "coulomb + viscous w^exponent without a truck on the drum"
        )
    if not low * 1.01 < exponent < high * 0.99:
        raise LossesError(
            f"the exponent of the friction is not determined: it runs to {exponent:.2f}, the end "
            f"of its range, over {_range(omega)}; expected slower and faster speeds"
        )


def _range(omega: Array) -> str:
    return f"{omega.min():.2f} .. {omega.max():.2f} rad/s at the gear output"


def _linear(exponent: float, omega: Array, torque: Array, weight: Array) -> tuple[float, float]:
    """Constant part (not negative) and rising part for an exponent, by least squares."""
    power = omega**exponent
    scale = np.sqrt(weight)
    columns = np.column_stack((scale, scale * power))
    coulomb, viscous = np.linalg.lstsq(columns, scale * torque, rcond=None)[0]
    if coulomb < 0.0:
        return 0.0, float(np.sum(weight * power * torque) / np.sum(weight * power**2))
    return float(coulomb), float(viscous)


def _search(omega: Array, torque: Array, weight: Array) -> float:
    """Exponent with the least sum of weighted squares."""

    def cost(exponent: float) -> float:
        coulomb, viscous = _linear(exponent, omega, torque, weight)
        return float(np.sum(weight * (torque - coulomb - viscous * omega**exponent) ** 2))

    best = int(np.argmin([cost(float(one)) for one in GRID]))
    low, high = float(GRID[max(best - 1, 0)]), float(GRID[min(best + 1, len(GRID) - 1)])
    while high - low > 1e-9:
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        low, high = (low, right) if cost(left) < cost(right) else (left, high)
    return float(0.5 * (low + high))


def _slopes(omega: Array, viscous: float, exponent: float) -> Array:
    """Derivatives of the friction by coulomb, viscous and exponent, shape (n, 3)."""
    power = omega**exponent
    return np.column_stack((np.ones_like(omega), power, viscous * power * np.log(omega)))


def _covariance(
    omega: Array, weight: Array, residuals: Array, values: tuple[float, float, float]
) -> Array:
    """Covariance of coulomb, viscous, exponent, shape (3, 3); zero for a held constant part."""
    coulomb, viscous, exponent = values
    free = slice(1 if coulomb == 0.0 else 0, 3)
    slopes = _slopes(omega, viscous, exponent)[:, free]
    freedom = len(omega) - slopes.shape[1]
    scatter = max(1.0, float(np.sum(weight * residuals**2)) / freedom)
    covariance = np.zeros((3, 3))
    covariance[free, free] = scatter * np.linalg.inv(slopes.T @ (weight[:, None] * slopes))
    return covariance
