"""The confidence in a verdict: the probability that it is right, by trials of known truth.

    log(p / (1 - p)) = a + b x

x is a feature of an answer, and a and b are estimated from the cases of a trial that have a
verdict of the same kind (logistic regression with Gaussian priors; C. M. Bishop, Pattern
Recognition and Machine Learning, 2006, 4.5; as a calibration: J. Platt 1999). The posterior odds of
the named set alone do not say how often such an answer is right: the laws of machines are not quite
those of the library, and the noise of logs is not quite what the model takes it for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

# Verdicts whose cases are counted together: neither names an effect, for the same reason.
ALIKE = {"parameter": "none"}
# Prior standard deviations: odds of 1 to 20 and 20 to 1 for the share of right answers, and a
# feature that changes them by e a unit.
PRIOR_STD = np.array([3.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class Standing:
    """How an answer stands among the hypotheses.

    log_odds : of the named set against its best rival, in the mean square that it leaves [nats]; of
        a verdict that names nothing, those of the best set
    """

    kind: str
    log_odds: float


@dataclass(frozen=True, kw_only=True)
class TrialVerdict(Standing):
    """A verdict of a blind trial, and whether it was right."""

    right: bool


def confidence(cases: Sequence[TrialVerdict], answer: Standing) -> float | None:
    """Probability that a verdict is right [1]; None: the trial had no such verdict."""
    same = [one for one in cases if _group(one) == _group(answer)]
    if not same:
        return None
    x = np.stack([_features(one) for one in same])
    weights = _regress(x, np.array([one.right for one in same], float))
    return float(expit(_features(answer) @ weights))


def _group(answer: Standing) -> str:
    return ALIKE.get(answer.kind, answer.kind)


def _features(answer: Standing) -> Array:
    """1 and the feature, a logarithm, because evidence grows with the length of the logs.

    The best rival of an answer that tells all is the same with one more effect, which gains nothing
    and needs its gain. Smaller odds say that a rival is near. Odds far above say that no other
    effect was asked for beside the set, and negative ones that the set is not the best: both where
    more than noise is left, and then the odds say no more than that.
    """
    complete = SETTINGS.needed_again if answer.kind == "effect" else SETTINGS.needed
    distance = min(abs(complete - answer.log_odds), SETTINGS.needed_again)
    return np.array([1.0, np.log1p(distance)])


def _regress(x: Array, right: Array) -> Array:
    """Most probable weights of the features, shape (2,)."""

    def loss(weights: Array) -> float:
        logits = x @ weights
        misfit = np.logaddexp(0.0, logits) - right * logits
        return float(misfit.sum() + 0.5 * np.sum((weights / PRIOR_STD) ** 2))

    return np.asarray(minimize(loss, np.zeros(x.shape[1])).x)
