"""Other forms of an effect's law: its size differs with the speed and with the load (pure).

A machine may follow another law than the library's. Its friction then grows otherwise with the
speed or with the load, so that the library's law holds with another size at each of them:

    size(t) = neutral + (size - neutral) (1 + sum of c_k P_k(u(t)))

P_k are Legendre polynomials over 0 to 1 with a mean square of 1; u is the measured speed of the
motor, the measured shaft torque or the measured armature current, over its largest value in the
run. The torque is the load of the gear and of what turns behind it, the current that of the motor
and of the drive. The coefficients c_k are relative errors of the law, and unknowns like any other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.legendre import Legendre

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.signals.log import Array, Log

# Measured channels that a law may depend on otherwise, and the degrees of the polynomials: a
# polynomial has at most two turning points.
CHANNELS = ("motor_speed", "shaft_torque", "armature_current")
DEGREES = (1, 2, 3)
# Quantile of a channel's sizes that counts as the largest: spikes are larger.
LARGEST = 0.99
# What stands between the name of a size and that of a form.
_MARK = " by "


def form_names(size: str) -> tuple[str, ...]:
    """Names of the coefficients of the forms of a size."""
    return tuple(f"{size}{_MARK}{channel} {k}" for channel in CHANNELS for k in DEGREES)


def split_law_forms(values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Divide values by name into those of the model, and coefficients of forms."""
    forms = {name: value for name, value in values.items() if _MARK in name}
    return {name: value for name, value in values.items() if name not in forms}, forms


def size_factors(forms: Mapping[str, float], log: Log) -> dict[str, Array]:
    """Factor on the distance of each size from neutral at the samples of a log, shape (n,).

    A value that is not finite counts as 0. A log without the channel tells nothing of its forms.
    """
    factors: dict[str, Array] = {}
    for name, coefficient in forms.items():
        size, _, form = name.partition(_MARK)
        channel, _, degree = form.partition(" ")
        if channel not in log:
            continue
        factor = factors.setdefault(size, np.ones_like(log.time))
        factor += coefficient * _polynomial(np.abs(np.nan_to_num(log[channel])), int(degree))
    return factors


def _polynomial(value: Array, degree: int) -> Array:
    """A Legendre polynomial of a channel over its largest value, with a mean square of 1."""
    largest = max(float(np.quantile(value, LARGEST)), np.finfo(float).tiny)
    basis = Legendre.basis(degree, domain=[0.0, 1.0])
    return np.asarray(np.sqrt(2.0 * degree + 1.0) * basis(np.minimum(value, largest) / largest))
