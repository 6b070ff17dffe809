"""Which runs of a diagnosis are fitted, and which are held out and predicted."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.prediction.held_out import Plan
from plant_emulator.errors import DiagnosisError
from plant_emulator.recordings.preflight import LEAST_MOTION

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Log

# Share of a single log that is fitted; the rest is predicted.
FITTED_SHARE = 0.6


def plan_of_runs(runs: int, count: int) -> Plan:
    """Plan to predict the runs after the first `count`; without any, each run in turn."""
    fitted = tuple(range(count))
    if runs > count:
        return Plan(fitted=fitted, folds=((fitted, tuple(range(count, runs))),))
    turns = tuple((tuple(k for k in fitted if k != run), (run,)) for run in fitted)
    return Plan(fitted=fitted, folds=turns)


def plan_recordings(recordings: Sequence[Recording], count: int) -> tuple[list[Recording], Plan]:
    """The runs of a diagnosis and the plan for them; the first `count` recordings are to be fitted.

    The recordings after these are predicted. Without any, each of several recordings is predicted
    in turn, but not by runs of trucks whose torque nobody measured: these say too little of gear
    and drum. A single recording is fitted on its first part and predicted on the rest.
    """
    if len(recordings) > 1:
        plan = plan_of_runs(len(recordings), count)
        unknown = [r.estimated_torque for r in recordings]
        telling = tuple(
            (fitted, predicted)
            for fitted, predicted in plan.folds
            if not all(unknown[k] for k in fitted) or all(unknown[k] for k in predicted)
        )
        return list(recordings), replace(plan, folds=telling or plan.folds)
    (whole,) = recordings
    end = whole.log.time[0] + FITTED_SHARE * float(np.ptp(whole.log.time))
    first = whole.log.time <= end
    _both_move(whole.log, first)
    both = [replace(whole, use=whole.use & part) for part in (first, ~first)]
    return both, Plan(fitted=(0,), folds=(((0,), (1,)),), as_fitted=True)


def _both_move(log: Log, first: NDArray[np.bool_]) -> None:
    """Refuse a single log of which one part shows no motion: it would be judged by noise."""
    for which, part, share in (("first", first, FITTED_SHARE), ("last", ~first, 1 - FITTED_SHARE)):
        span = float(np.ptp(log["motor_speed"][part]))
        if span < LEAST_MOTION:
            raise DiagnosisError(
                f"{log.source}: no held-out run is possible: in the {which} {100 * share:.0f} % "
                f"of it motor_speed_rad_s moves by {span:.1f} rad/s only, {LEAST_MOTION:g} or more "
                "are needed; give another run beside it, or one to hold out"
            )
