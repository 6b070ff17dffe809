"""The answer of a diagnosis, schema gap-diagnosis/1, from what its steps found."""

from __future__ import annotations

from dataclasses import replace
from math import hypot
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.diagnosis.calibration.model_form_error import scale
from plant_emulator.diagnosis.fitting.evidence import DETECTABLE, THRESHOLD
from plant_emulator.diagnosis.prediction.gap import combined
from plant_emulator.diagnosis.prediction.trace import Trace
from plant_emulator.diagnosis.report.details import Step

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Contender, Explanation
    from plant_emulator.diagnosis.machine import Candidate, Run
    from plant_emulator.diagnosis.prediction.gap import Gap, Prediction
    from plant_emulator.signals.log import Array

# Effects of no account that a ranking still shows.
SHOWN = 5


def ranged(gap: Gap, runs: Sequence[Run]) -> dict[str, float]:
    """NRMSD of every channel: its rms over its measured range, held-out samples of all runs."""
    return dict(zip(gap.channels, _shares(gap, runs, gap.by_channel), strict=True))


def noise_floor(gap: Gap, runs: Sequence[Run]) -> dict[str, float]:
    """The noise of every channel over its measured range, as `ranged`."""
    return dict(zip(gap.channels, _shares(gap, runs, np.ones(len(gap.channels))), strict=True))


def _shares(gap: Gap, runs: Sequence[Run], times: Array) -> list[float]:
    """So many times the noise of each channel over the range of its samples that count."""
    found = []
    for k, name in enumerate(gap.channels):
        own = [(r, w) for r, w in zip(runs, gap.weights, strict=True) if name in r.channels]
        counted = [run.measured[run.channels.index(name)][w[k] > 0.0] for run, w in own]
        found.append(float(times[k] * gap.noise[k] / np.ptp(np.concatenate(counted))))
    return found


def ranked(explained: Explanation) -> list[Contender]:
    """Effects with evidence or accepted, and a few of those without, the best first.

    What is needed beside another effect may have little evidence alone.
    """
    order = sorted(explained.contenders, key=explained.evidence, reverse=True)
    counting = [c for c in order if explained.evidence(c) > THRESHOLD]
    shown = max(SHOWN, len(counting))
    accepted = [c for c in order[shown:] if c.effect in explained.named]
    return [*order[:shown], *accepted]


def with_chance(explained: Explanation) -> FitResult:
    """The final fit with the sizes and shapes of effects whose course is chance."""
    values: dict[str, float] = {}
    for one in explained.chance:
        values |= {one.name: one.size, **one.shape}
    errors = {one.name: one.error for one in explained.chance}
    final = explained.final
    return replace(final, values={**final.values, **values}, errors={**final.errors, **errors})


def rank(
    contender: Contender,
    explained: Explanation,
    accepted: Sequence[str],
    candidate: Candidate,
    gain: float | None,
    law_errors: Mapping[str, float],
) -> dict[str, Any]:
    """One line of the ranking; sizes and errors of an accepted effect from the final fit.

    law_errors : standard errors by name that other laws of an effect make; see `law_error`
    """
    name = contender.effect
    usual = {u.name: abs(u.start - candidate.neutral[u.name]) for u in candidate.sizes}
    point = with_chance(explained) if name in accepted else contender.point
    # Of an effect of chance course the size is all that is estimated.
    shapes = () if candidate.untold else candidate.shapes
    names = [u.name for u in (*candidate.sizes, *shapes)]
    return {
        "effect": name,
        "subsystem": candidate.subsystem,
        "evidence": explained.evidence(contender),
        "held_out_gain": gain,
        "parameters": [
            {
                "name": full.removeprefix(f"{name}_"),
                "value": point.values[full],
                "standard_error": hypot(
                    point.errors[full],
                    law_errors.get(full, 0.0) * scale(point.values[full], usual.get(full, 0.0)),
                ),
                "unit": candidate.units[full],
            }
            for full in names
            if point is not None
        ],
        "accepted": name in accepted,
    }


def undetectable(
    explained: Explanation, candidates: Mapping[str, Candidate]
) -> list[dict[str, str]]:
    """Effects that these logs could not show at their plausible size, with the reason."""
    return [
        {"effect": c.effect, "reason": hidden(c, candidates[c.effect])}
        for c in explained.contenders
        if c.norm < DETECTABLE
        and c.effect not in explained.named
        and explained.evidence(c) <= THRESHOLD
    ]


def hidden(contender: Contender, candidate: Candidate) -> str:
    """Why an effect does not show."""
    if candidate.untold:
        return candidate.needs or "its course is chance, and too small here to be seen"
    if contender.raw < DETECTABLE:
        reason = "too small in these channels and runs at its plausible size"
    else:
        reason = f"drift of {contender.imitated_by} looks the same"
    return f"{reason}; {candidate.needs}" if candidate.needs else reason


def waterfall(gaps: Mapping[tuple[str, ...], Gap], accepted: Sequence[str]) -> tuple[Step, ...]:
    """The held-out gap as given, recalibrated, and with every accepted effect added in turn."""
    labels = {("nominal",): "parameter set as given", (): "recalibrated"}
    labels |= {
        tuple(accepted[: k + 1]): f"with {name}" if k == 0 else f"and {name}"
        for k, name in enumerate(accepted)
    }
    steps = []
    for key, label in labels.items():
        value, low, high = combined(gaps[key])
        steps.append(Step(label=label, gap=value, low=low, high=high))
    return (*steps, Step(label="noise floor", gap=1.0, low=1.0, high=1.0))


def traces(
    runs: Sequence[Run], before: Sequence[Prediction], after: Sequence[Prediction]
) -> tuple[Trace, ...]:
    """Measured and predicted channels of all held-out runs, those with samples that count."""
    pairs = zip(
        runs,
        [r for prediction in before for r in prediction.residuals],
        [r for prediction in after for r in prediction.residuals],
        strict=True,
    )
    return tuple(
        Trace(
            source=run.source,
            channel=name,
            unit=run.units[k],
            time=run.time,
            measured=run.measured[k],
            recalibrated=_simulated(run, k, first),
            explained=_simulated(run, k, second),
            noise=float(run.noise[k]),
        )
        for run, first, second in pairs
        for k, name in enumerate(run.channels)
        if first[k].any()
    )


def _simulated(run: Run, channel: int, residual: Array) -> Array:
    """The prediction behind a whitened residual; NaN where a sample does not count.

    Of a voltage it holds what its sensor is off by.
    """
    whitened = np.where(residual[channel] == 0.0, np.nan, residual[channel])
    return np.asarray(run.measured[channel] - whitened * run.noise[channel])
