"""The model-form error: how far a size may be off because the machine follows another law.

The standard error of a fit contains the noise only. The machine's oil or tyre may follow another
equation than the library's. Cases of known truth show how much that matters: effects that are
hidden by other laws and fitted by the library's. Their deviation joins the standard error,

    s^2 = s_fit^2 + (e * reference size)^2

as the error of a method joins that of a reading (JCGM 100:2008, 5.1.2 and G.3); e is the relative
error of `model_form_errors`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtri, stdtrit

if TYPE_CHECKING:
    from collections.abc import Sequence

# Quantile up to which the widened intervals hold.
PROBABILITY = 0.975


@dataclass(frozen=True, kw_only=True)
class EstimatedSize:
    """A size of an effect that another law hides, and its estimate by the library's law.

    name : of the parameter, behind the name of its effect
    true, estimated, standard_error : [its unit]
    plausible : usual size of the effect [its unit]
    """

    name: str
    true: float
    estimated: float
    standard_error: float
    plausible: float


def model_form_errors(cases: Sequence[EstimatedSize]) -> dict[str, float]:
    """Standard error of each size that other laws make, relative to its reference size [1].

    It is the root mean square of what deviates beyond the noise. Few cases are known, so it is
    widened by the ratio of Student's quantile to the normal one.
    """
    names = sorted({c.name for c in cases})
    return {name: _relative_error([c for c in cases if c.name == name]) for name in names}


def reference_size(estimated: float, plausible: float) -> float:
    """Size that a model-form error is relative to: the estimate, or the larger plausible size.

    Another law may take nearly all of a size, so that the estimate alone would be too small.
    """
    return max(abs(estimated), plausible)


def size_error(value: float, standard_error: float, plausible: float, form_error: float) -> float:
    """Standard error of a size with the model-form error [its unit].

    value, plausible : distances of the size and of the usual size from neutral [its unit]
    standard_error : of the fit [its unit]; form_error : relative [1]
    """
    return hypot(standard_error, form_error * reference_size(value, plausible))


def _relative_error(cases: Sequence[EstimatedSize]) -> float:
    squares = [
        max(0.0, (c.true - c.estimated) ** 2 - c.standard_error**2)
        / reference_size(c.estimated, c.plausible) ** 2
        for c in cases
    ]
    widened = stdtrit(len(cases), PROBABILITY) / ndtri(PROBABILITY)
    return float(widened * np.sqrt(np.mean(squares)))
