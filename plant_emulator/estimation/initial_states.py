"""Initial states of a run: its position in the backlash gap, and the initial states of effects.

They belong to one run only. A run that is predicted keeps all parameters; only its initial states
are fitted to it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.least_squares import estimate
from plant_emulator.estimation.residuals import run_residual
from plant_emulator.estimation.robust_scan import scan_unknowns
from plant_emulator.estimation.start_search import StartSearch
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.solver.kernel import kernel

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.effects import Effect
    from plant_emulator.estimation.unknowns import Estimate, Residual
    from plant_emulator.recordings.recording import Recording

    Effects = Mapping[str, Mapping[str, float]]

GAP = Unknown(name=GAP_POSITION, start=0.0, lower=-1.0, upper=1.0, logarithmic=False)
# Gap positions that a scan tries.
GAP_SCAN_POINTS = 41


def states_of(own: Effects, known: Mapping[str, Effect] | None = None) -> tuple[Unknown, ...]:
    """Unknowns of the initial states of a run; the position in the gap is the first.

    own : values of the effects that the bench has, by effect and parameter [SI]
    known : the effects by name; None: those of the kernel
    """
    known = known if known is not None else kernel().effects
    return (
        GAP,
        *(
            Unknown(
                name=f"{effect}_{key}",
                start=value,
                lower=declared.lower,
                upper=declared.upper,
                logarithmic=False,
                prior=value,
                std=declared.std,
                step=declared.step,
                angle=declared.angle,
            )
            for effect, values in own.items()
            for key, value in values.items()
            if (declared := known[effect].parameters[key]).per_run and declared.std is not None
        ),
    )


def with_logged_values(
    recording: Recording, own: Effects, known: Mapping[str, Effect] | None = None
) -> Recording:
    """The recording with those values of effects that its log measures, such as a temperature.

    own, known : as for `states_of`
    """
    known = known if known is not None else kernel().effects
    measured = {
        f"{effect}_{key}": float(np.mean(recording.log[signal]))
        for effect, values in own.items()
        for key in values
        if (signal := known[effect].parameters[key].measured) and signal in recording.log
    }
    return replace(recording, logged_values=measured)


def fit_states(
    recording: Recording, values: Mapping[str, float], states: Sequence[Unknown]
) -> dict[str, float]:
    """Fit the states of a run to its log, all parameters as given: scans, then least squares.

    values : all parameters [SI]; states : the gap position among them
    """
    values = {**values, **recording.logged_values}
    residual = run_residual(recording, values)
    others = [u for u in states if u.name != GAP_POSITION]
    starts = scan_states(recording, values, [others], residual)
    return fit_from(starts, states, residual).states(0)


def scan_states(
    recording: Recording,
    values: Mapping[str, float],
    groups: Sequence[Sequence[Unknown]],
    residual: Residual,
    plain: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """Find states of a run in the best basin by scans, all parameters as given.

    The gap position is scanned first, with all other states at their starts. Then each group of
    states is scanned: all states together would be too many. A ripple whose phase is not known yet
    can mislead the first scan. Therefore both are repeated at the gap position of the plain bench.

    values : all parameters [SI]; groups : the states but the gap position
    residual : of the run, as a function of its states
    plain : parameters without effects; None: no state is a phase
    """
    starts = {u.name: u.start for group in groups for u in group}
    every = [{**values, **starts}] if plain is None else [{**values, **starts}, plain]
    found = []
    for known in every:
        search = StartSearch([recording], known, ())
        search.scan_gaps(GAP_SCAN_POINTS)
        states = {GAP_POSITION: search.gaps[0], **starts}
        for group in groups:
            states = scan_unknowns(residual, states, group)
        found.append(states)
    if len(found) == 1:
        return found[0]
    return min(found, key=lambda states: float(np.sum(residual(states) ** 2)))


def fit_from(
    starts: Mapping[str, float], states: Sequence[Unknown], residual: Residual
) -> Estimate:
    """Fit the states of a run by least squares from these starts; the run is number 0.

    residual : of the run, as a function of its states
    """
    unknowns = [
        replace(u, run=0, start=float(np.clip(starts[u.name], u.lower, u.upper))) for u in states
    ]
    return estimate(unknowns, [residual])
