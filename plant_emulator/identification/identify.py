"""Grey-box identification of the bench from its logs.

 1. Start values without simulation (`equation_error`).
 2. One-dimensional scans of what that leaves open: dead time, gap, shaft damping, and where in the
    gap each run starts, by simulation and with a robust loss.
 3. Bounded least squares on all simulated channels of all logs at once, whitened by the noise
    measured in the logs (`estimation`), with the start in the gap as a free state of each run.
    A residual above the noise suggests a local minimum: the fit is repeated from other basins.
 4. For logs with a truck, a refit that is whitened for the noise of the wheel torque
    (`input_noise`).
 5. For logs whose noise has a colour, hum or outliers, a refit that is whitened for the noise that
    the fit leaves (`estimation.noise`).

The prior of a parameter is its value and standard deviation in the set. The priors hold parameters
that the logs do not determine. The prior of a parameter is dropped where the data alone determine
it better, so that a wrong set cannot bias the answer. A parameter is identifiable if the data alone
bring its standard error under half of the prior one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from plant_emulator.estimation import least_squares
from plant_emulator.estimation.equation_error import start_values
from plant_emulator.estimation.free_parameters import free_parameters, unknowns
from plant_emulator.estimation.initial_states import GAP, states_of, with_logged_values
from plant_emulator.estimation.noise.logged_noise import noise_of_runs
from plant_emulator.estimation.residuals import residual_functions, whiten_functions
from plant_emulator.estimation.start_search import FINE_SCANS, StartSearch
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.signals.noise import NoiseSeries
from plant_emulator.simulation.simulate import FIT_TOLERANCE, values_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from plant_emulator.estimation.initial_states import Effects
    from plant_emulator.estimation.noise.channel_noise import ChannelNoise
    from plant_emulator.estimation.start_search import Progress
    from plant_emulator.estimation.unknowns import Estimate, Residual, Unknown
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording

# The last fit, but for a truck, whose staircase of references takes ten times as long: a step more
# or less in the simulation then changes the cost by less than a thousandth of a standard error.
FINAL_TOLERANCE = 5e-7
# Share of the prior deviation (or of the value) under which a standard error is information.
INFORMED = 0.5
INFORMED_WITHOUT_PRIOR = 0.1
# chi^2 per sample above which other basins are tried.
NOISE_REACHED = 1.2
RETRIES = 3
# Estimates of the logs' noise, at most; the last ones change little.
NOISE_ESTIMATES = 3


@dataclass(frozen=True, kw_only=True)
class EstimatedParameter:
    """An estimated parameter; all numbers in `unit`.

    data_error : standard error from the data alone; infinite: they say nothing of it
    enough : the largest data_error at which the parameter counts as identifiable
    nominal : its value before
    at_bound : whether the estimate lies at the end of its range
    """

    name: str
    value: float
    standard_error: float
    data_error: float
    enough: float
    nominal: float
    unit: str

    at_bound: bool

    @property
    def identifiable(self) -> bool:
        """Whether the data determine the parameter; see the text of the module."""
        return self.data_error <= self.enough and not self.at_bound


@dataclass(frozen=True, kw_only=True)
class Identification:
    """The fit of one bench.

    states : initial states of every run, by name [SI]
    chi_squared : mean square of the whitened residual; 1: nothing but noise is left
    noise : by channel, over the noise of the recordings; empty: the noise is white and as large
    """

    parameter_set: ParameterSet
    parameters: tuple[EstimatedParameter, ...]
    states: tuple[Mapping[str, float], ...]
    estimate: Estimate
    chi_squared: float
    noise: Mapping[str, ChannelNoise] = field(default_factory=dict)

    @property
    def gap_positions(self) -> tuple[float, ...]:
        """The start of each run in the backlash gap, from -1 to 1."""
        return tuple(states[GAP_POSITION] for states in self.states)


def identify(
    recordings: Sequence[Recording],
    parameters: ParameterSet,
    free: Sequence[str] = (),
    *,
    effects: Effects | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Estimate the free parameters of a bench from its logs.

    free : names; none: all that the set calls estimated and the logs show, see `free_parameters`
    effects : values of effects that the bench has, by effect and parameter [SI]; the initial states
        among them are fitted for every run, or taken from its log
    progress : called with a stage's name and its done share, 0 to 1
    Raises IdentificationError for a parameter that cannot be free.
    """
    free = free_parameters(parameters, free, recordings)
    states = states_of(effects or {})
    recordings = [with_logged_values(r, effects or {}) for r in recordings]
    values = values_of(parameters, effects)
    search = StartSearch(recordings, values, free, progress)
    logs = [r.log for r in recordings]
    search.values |= start_values(logs, parameters, free)
    search.scan()
    best = fit_from(recordings, parameters, free, search, states, progress)
    for retry in range(RETRIES):
        if chi_squared(best) <= NOISE_REACHED:
            break
        retried = _next_search(recordings, values, free, best, retry)
        other = fit_from(recordings, parameters, free, retried, states, progress)
        search.simulations += retried.simulations
        best = min(best, other, key=lambda e: e.cost + e.penalty)
    wanted = unknowns(parameters, free, search.values, search.gaps, states)
    report = _report_cost(recordings, progress)
    residuals = whiten_functions(recordings, search.values, free, best)
    if residuals is not None:
        best = _refit(wanted, residuals, best, report)
    else:
        residuals = residual_functions(recordings, search.values, free, _tolerance(recordings))
    best, noise = _fit_with_logged_noise(recordings, residuals, wanted, best, report)
    best = replace(best, simulations=best.simulations + search.simulations)
    return replace(identification_of(best, parameters, free, len(recordings)), noise=noise)


def fit_from(
    recordings: Sequence[Recording],
    parameters: ParameterSet,
    free: Sequence[str],
    search: StartSearch,
    states: Sequence[Unknown] = (GAP,),
    progress: Progress | None = None,
) -> Estimate:
    """Fit by least squares from the values of a search, then again without the outdone priors."""
    coarse = residual_functions(recordings, search.values, free)
    fine = residual_functions(recordings, search.values, free, _tolerance(recordings))
    report = _report_cost(recordings, progress)
    wanted = unknowns(parameters, free, search.values, search.gaps, states)
    first = least_squares.estimate(wanted, coarse, progress=report)
    last = least_squares.estimate(
        _without_outdone_priors(first), fine, progress=report, symmetric=True
    )
    return replace(last, simulations=first.simulations + last.simulations)


def _without_outdone_priors(first: Estimate) -> list[Unknown]:
    """Unknowns that start at a fit, without the priors that are weaker than its data."""
    return [
        replace(u, start=u.value(float(z)), std=None if error < u.scaled_std else u.std)
        for u, z, error in zip(first.unknowns, first.z, first.data_errors, strict=True)
    ]


def _tolerance(recordings: Sequence[Recording]) -> float:
    """Tolerance of the simulations of a last fit."""
    truck = any(recording.inputs.truck for recording in recordings)
    return FIT_TOLERANCE if truck else FINAL_TOLERANCE


def _refit(
    wanted: Sequence[Unknown],
    residuals: Sequence[Residual],
    best: Estimate,
    report: Callable[[float], None] | None,
) -> Estimate:
    """Fit residuals that are whitened for further noise, from the best fit without it.

    wanted : the unknowns with all priors; the whitened data outdo fewer of them
    """
    near = [replace(u, start=u.value(float(z))) for u, z in zip(wanted, best.z, strict=True)]
    first = least_squares.estimate(near, residuals, progress=report)
    last = least_squares.estimate(
        _without_outdone_priors(first), residuals, progress=report, symmetric=True
    )
    simulations = best.simulations + first.simulations + last.simulations
    return replace(last, simulations=simulations)


def _fit_with_logged_noise(
    recordings: Sequence[Recording],
    residuals: Sequence[Residual],
    wanted: Sequence[Unknown],
    best: Estimate,
    report: Callable[[float], None] | None,
) -> tuple[Estimate, Mapping[str, ChannelNoise]]:
    """Refit with residuals that are whitened for the noise that the fit leaves; give it too.

    Gives the best fit and no noise where that is white and as large as the recordings say, and
    where the fit leaves what is no noise of a sensor: noise that follows a misfit would hide it.
    """
    noise, plain = None, best
    for _ in range(NOISE_ESTIMATES):
        found = noise_of_runs(_list_series(recordings, residuals, best))
        if not all(one.of_sensor for one in found.channels.values()):
            return plain, {}
        if found.plain if noise is None else noise.resembles(found):
            break
        noise = found
        whitened = [noise.whitened(k, residual) for k, residual in enumerate(residuals)]
        best = _refit(wanted, whitened, best, report)
    return best, noise.channels if noise else {}


def _list_series(
    recordings: Sequence[Recording], residuals: Sequence[Residual], best: Estimate
) -> Iterator[tuple[int, str, NoiseSeries]]:
    """Run, channel and residual of a fit, for every channel of every run."""
    for k, (recording, residual) in enumerate(zip(recordings, residuals, strict=True)):
        rows = residual({**best.parameters(), **best.states(k)})
        for name, row, use in zip(recording.channels, rows, recording.use, strict=True):
            yield k, name, NoiseSeries(time=recording.log.time, value=row, use=use)


def _report_cost(
    recordings: Sequence[Recording], progress: Progress | None
) -> Callable[[float], None] | None:
    """Function that reports the progress of a fit from its cost; a chi^2 of 2 is half way."""
    if progress is None:
        return None
    counted = sum(int(r.use.sum()) for r in recordings)
    return lambda cost: progress("least squares", min(1.0, counted / max(cost, 1.0)))


def _next_search(
    recordings: Sequence[Recording],
    values: Mapping[str, float],
    free: Sequence[str],
    best: Estimate,
    retry: int,
) -> StartSearch:
    """Search for another basin, from the fit with gap and dead time moved off its minimum."""
    search = StartSearch(recordings, {**values, **best.parameters()}, free)
    search.gaps = [best.states(k)[GAP_POSITION] for k in range(len(recordings))]
    if retry:
        search.values |= {
            name: search.values[name] * (1.0 + 0.05 * (-1) ** retry)
            for name in ("backlash_half_gap", "dead_time")
            if name in free
        }
    search.scan(FINE_SCANS)
    return search


def chi_squared(found: Estimate) -> float:
    """Mean square of the whitened residual per degree of freedom; 1: nothing but noise is left."""
    return found.cost / max(1, found.samples - len(found.unknowns))


def identification_of(
    found: Estimate, parameters: ParameterSet, free: Sequence[str], runs: int
) -> Identification:
    """The estimate as parameters in their own units, and the set with their values."""
    estimated = [_parameter(found, k, parameters) for k in range(len(free))]
    return Identification(
        parameter_set=parameters.with_values({p.name: p.value for p in estimated}),
        parameters=tuple(estimated),
        states=tuple(found.states(k) for k in range(runs)),
        estimate=found,
        chi_squared=chi_squared(found),
    )


def _parameter(found: Estimate, k: int, parameters: ParameterSet) -> EstimatedParameter:
    unknown = found.unknowns[k]
    value = unknown.value(float(found.z[k]))
    std = parameters[unknown.name].std
    return EstimatedParameter(
        name=unknown.name,
        value=value,
        standard_error=unknown.error(value, float(found.standard_errors[k])),
        data_error=unknown.error(value, float(found.data_errors[k])),
        nominal=parameters.value(unknown.name),
        enough=INFORMED_WITHOUT_PRIOR * value if std is None else INFORMED * std,
        unit=parameters[unknown.name].unit,
        at_bound=not 1.001 * unknown.lower < value < unknown.upper / 1.001,
    )
