"""Which parameters of the bench a fit may move, and within what (pure)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from plant_emulator.errors import IdentificationError
from plant_emulator.estimation.initial_states import GAP
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.wheel_torque import TAKEN
from plant_emulator.signals.log import VOLTAGE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording

# Held fixed unless asked for: a log shows it only through J_g + xi^2 J_m.
NOT_FREE = frozenset({"gear_inertia"})
# Given: the current loop hides R_a without the voltage, which with it also wants the right K_m.
IN_VOLTAGE = ("armature_resistance", "flux_constant")
# Estimated on a linear scale. A bench near the limit of its voltage shows the weakened flux,
# c_1 / (c_2 + speed), at few speeds: the valley of the cost is straight in both constants and bent
# in their logarithms. Fits stalled in the bent one, at seven times the noise.
LINEAR = frozenset({"flux_constant_1", "flux_constant_2"})
# A parameter may leave its value in the set by this factor either way.
BOUND_FACTOR = 5.0


def unknowns(
    parameters: ParameterSet,
    free: Sequence[str],
    start: Mapping[str, float],
    gaps: Sequence[float],
    states: Sequence[Unknown] = (GAP,),
) -> list[Unknown]:
    """The free parameters with their priors, and the states of every run.

    start : values [SI] of the parameters; gaps : of every run, -1 to 1
    """
    wide = [
        Unknown(
            name=name,
            start=start[name],
            lower=parameters.value(name) / BOUND_FACTOR,
            upper=parameters.value(name) * BOUND_FACTOR,
            logarithmic=name not in LINEAR,
            scale=parameters.value(name),
            prior=parameters.value(name),
            std=parameters[name].std,
        )
        for name in free
    ]
    return wide + [
        replace(state, run=run, start=gap if state.name == GAP_POSITION else state.start)
        for run, gap in enumerate(gaps)
        for state in states
    ]


def free_parameters(
    parameters: ParameterSet, names: Sequence[str] = (), recordings: Sequence[Recording] = ()
) -> tuple[str, ...]:
    """The names given, or all that the set calls estimated but those of NOT_FREE and zeros.

    recordings : of the fit. If one has the voltage, what only that shows is free as well. If a
        truck's torque that nobody measured acted in every run, what its estimate takes is not free.

    Raises IdentificationError for a name that is unknown, calculated from others, or 0 in the set.
    """
    for name in names:
        if name not in parameters.values():
            known = ", ".join(parameters.values())
            raise IdentificationError(
                f"{name}: no parameter of the bench; known: {known}", argument="free"
            )
        if parameters.value(name) == 0.0:
            raise IdentificationError(
                f"{name}: it is 0 in {parameters.name}; a fit needs a value above 0",
                argument="free",
            )
        if parameters[name].kind == "calculated":
            raise IdentificationError(
                f"{name}: it is calculated from others; give it a value of its own, "
                'kind = "estimated", in a parameter set',
                argument="free",
            )
    voltage = any(VOLTAGE in r.channels for r in recordings)
    unknown_torque = bool(recordings) and all(r.estimated_torque for r in recordings)
    estimated = [
        p.name
        for p in parameters
        if p.kind == "estimated"
        and p.name not in (*NOT_FREE, *(TAKEN if unknown_torque else ()))
        and p.value > 0.0
    ]
    shown = [n for n in IN_VOLTAGE if voltage and parameters[n].kind == "given"]
    return tuple(dict.fromkeys(names)) or (*estimated, *shown)
