"""The orthogonal norm of a hidden effect: its size in the logs after nuisance projection.

The true law changes the noise-free logs at its hidden size. The change, whitened for the noise of
the case and its dirt, is projected orthogonally to the tangents of the nuisance parameters and
initial states at the truth, with their priors. A large norm is checked by a nonlinear fit of the
nuisance parameters to the noise-free logs, because these can follow more of the change than their
tangents show. The smaller norm counts.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.blind.dirt import whiten
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.estimation.free_parameters import free_parameters, unknowns
from plant_emulator.estimation.least_squares import estimate, linearise_at
from plant_emulator.estimation.nearby import Changed, OrImpossible
from plant_emulator.estimation.residuals import SimulatedRun
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import IMPOSSIBLE
from plant_emulator.signals.log import COMPARED
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.simulation.simulate import TOLERANCE, values_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.blind.case import Case, Hidden
    from plant_emulator.estimation.unknowns import Residual, Unknown
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.signals.log import Array, Log

# Norm above which an effect counts as detectable.
DETECTABLE = 7.0
# The nuisance fit: relative fall of the cost that ends it, number of iterations, and norm of the
# change over which the first derivatives are taken.
SETTLED_COST, FIT_ITERATIONS, COARSE_CHANGE = 1e-4, 10, 10.0


def noise_levels(channels: Sequence[str]) -> Array:
    """Standard deviation of noise and quantisation of each channel [SI], shape (channels,)."""
    pairs = [SENSORS[name] for name in channels]
    return np.array([np.hypot(deviation, step / np.sqrt(12.0)) for deviation, step in pairs])


def norms(case: Case, logs: Sequence[Log], parameters: ParameterSet) -> dict[str, float]:
    """Orthogonal norm of every hidden effect by name, with the other hidden effects present.

    logs : noise-free log of every run; parameters : the nominal set
    """
    return {hidden.effect: _norm(case, hidden, logs, parameters) for hidden in case.hidden}


def _norm(case: Case, hidden: Hidden, logs: Sequence[Log], parameters: ParameterSet) -> float:
    others = [h for h in case.hidden if h is not hidden]
    bench = parameters.with_values(case.parameters).values()
    free = free_parameters(parameters)
    wanted = unknowns(parameters, free, bench, case.gaps)
    without = [_simulation(case, k, log, parameters, others) for k, log in enumerate(logs)]
    complete = [_simulation(case, k, log, parameters, case.hidden) for k, log in enumerate(logs)]
    truth = {name: bench[name] for name in free}
    starts = [{**truth, GAP_POSITION: gap} for gap in case.gaps]
    base = [simulate_run(start) for simulate_run, start in zip(without, starts, strict=True)]
    whole = [simulate_run(start) for simulate_run, start in zip(complete, starts, strict=True)]
    change = [after - before for after, before in zip(whole, base, strict=True)]
    tangents = NuisanceSpace(
        linearise_at(wanted, [_minus(p, b) for p, b in zip(without, base, strict=True)])
    )
    norm = float(np.linalg.norm(tangents.orthogonal(np.concatenate([c.ravel() for c in change]))))
    if norm <= DETECTABLE:
        return norm
    away = [_minus(p, w) for p, w in zip(without, whole, strict=True)]
    bounded = [
        OrImpossible(one, np.full_like(w, IMPOSSIBLE)) for one, w in zip(away, whole, strict=True)
    ]
    return min(norm, _norm_after_fit(wanted, bounded))


def _norm_after_fit(wanted: Sequence[Unknown], residuals: Sequence[Residual]) -> float:
    """Norm that a fit of the nuisance parameters from the truth leaves.

    The first fit takes its derivatives over large differences, which smooths small local minima.
    """
    coarse = estimate(
        wanted, residuals, settled=SETTLED_COST, iterations=FIT_ITERATIONS, difference=COARSE_CHANGE
    )
    starts = [
        replace(u, start=float(np.clip(u.value(float(z)), u.lower, u.upper)))
        for u, z in zip(coarse.unknowns, coarse.z, strict=True)
    ]
    found = estimate(starts, residuals, settled=SETTLED_COST, iterations=FIT_ITERATIONS)
    return float(np.sqrt(min(one.cost for one in (coarse, found))))


def _minus(simulated: Residual, base: Array) -> Residual:
    """A simulation minus the constant `base`."""
    return Changed(simulated, lambda rows: rows - base)


def _simulation(
    case: Case, run: int, log: Log, parameters: ParameterSet, hidden: Sequence[Hidden]
) -> Residual:
    """A run simulated from parameters and gap position, whitened, shape (channels, samples)."""
    inputs, levels = inputs_of(log), noise_levels(COMPARED)
    effects = {h.law: h.in_run(run) for h in hidden}
    fixed = values_of(parameters.with_values(case.parameters), effects)

    def whitened(out: Log) -> Array:
        return whiten(np.stack([out[name] for name in COMPARED]), log.time, levels, case.dirt)

    return Changed(SimulatedRun(inputs, fixed, TOLERANCE), whitened)
