"""Effects of the library as unknowns of a fit to logs of the bench; subsystems of parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from plant_emulator.diagnosis.machine import Candidate
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.recordings.preflight import NAMES
from plant_emulator.signals.log import VOLTAGE, WHEEL_TORQUE
from plant_emulator.simulation.law_forms import form_names

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.effects import Effect, EffectParameter
    from plant_emulator.recordings.recording import Recording

    Role = Literal["size", "shape", "state", "stochastic", "fixed"]

# What an effect needs begins so, where the logged voltage shows it.
LOG_VOLTAGE = f"log {NAMES[VOLTAGE]}"
# Subsystems whose torques an unknown torque of a truck hides, and those that only a truck shows.
BEHIND_THE_GEAR = frozenset({"gear", "drum", "wheel_contact"})
WHEEL = frozenset({"wheel_contact"})
# What would show them.
LOG_WHEEL_TORQUE = f"log {NAMES[WHEEL_TORQUE]}"
OR_NO_TRUCK = ", or give a run without a truck"

# Subsystem of each parameter of the model.
SUBSYSTEMS = {
    "drive": ("dead_time", "speed_gain", "speed_integral_time", "current_gain"),
    "motor": (
        "armature_resistance",
        "flux_constant",
        "flux_constant_1",
        "flux_constant_2",
        "motor_inertia",
    ),
    "motor_shaft": ("motor_shaft_stiffness",),
    "gear": (
        "gear_inertia",
        "gear_ratio",
        "gear_coulomb_friction",
        "gear_viscous_friction",
        "gear_friction_exponent",
    ),
    "backlash_shaft": ("backlash_half_gap", "drum_shaft_damping", "drum_shaft_stiffness"),
    "drum": ("drum_inertia",),
}
SUBSYSTEM_OF = {name: subsystem for subsystem, names in SUBSYSTEMS.items() for name in names}


def candidate(effect: Effect, *, voltage: bool = False, unknown_torque: bool = False) -> Candidate:
    """Turn the declaration of an effect into unknowns.

    voltage : whether all logs have it
    unknown_torque : whether a truck's torque that nobody measured hides it
    """
    name, parameters = effect.name, effect.parameters
    unknowns: dict[str, list[Unknown]] = {r: [] for r in ("size", "shape", "state", "stochastic")}
    fixed: dict[str, float] = {}
    for key, declared in parameters.items():
        role = _role(declared)
        if role != "fixed":
            unknowns[role].append(_unknown(f"{name}_{key}", declared))
        if role in {"fixed", "stochastic"}:
            fixed[f"{name}_{key}"] = declared.plausible
    sizes = () if effect.exact else unknowns["size"]
    forms = (form for size in sizes for form in form_names(size.name))
    neutral = {f"{name}_{key}": declared.neutral for key, declared in parameters.items()}
    return Candidate(
        name=name,
        subsystem=effect.subsystem,
        sizes=tuple(unknowns["size"]),
        shapes=tuple(unknowns["shape"]),
        states=tuple(unknowns["state"]),
        neutral={u.name: neutral[u.name] for u in unknowns["size"]},
        fixed=fixed,
        units={f"{name}_{key}": declared.unit for key, declared in parameters.items()},
        title=effect.description.partition("\n")[0].rstrip("."),
        needs=_needs(effect, voltage=voltage, unknown_torque=unknown_torque),
        stochastic=tuple(unknowns["stochastic"]),
        exact_form=effect.exact,
        forms=tuple(forms),
    )


def hidden_effects(effects: Mapping[str, Effect], recording: Recording) -> frozenset[str]:
    """Names of the effects that a run cannot show, see `MeasuredRun.hides`."""
    subsystems = BEHIND_THE_GEAR if recording.estimated_torque else WHEEL
    if recording.inputs.truck and not recording.estimated_torque:
        return frozenset()
    return frozenset(name for name, one in effects.items() if one.subsystem in subsystems)


def _needs(effect: Effect, *, voltage: bool, unknown_torque: bool) -> str:
    """The sensor or manoeuvre that shows the effect and that these logs lack."""
    if unknown_torque:
        return LOG_WHEEL_TORQUE + ("" if effect.subsystem in WHEEL else OR_NO_TRUCK)
    return "" if voltage and effect.needs.startswith(LOG_VOLTAGE) else effect.needs


def _role(declared: EffectParameter) -> Role:
    """The part that a declared parameter plays in a fit.

    A prior makes it a shape, or a state where each run has its own. Without a prior it is a size
    where its plausible value is not neutral. A value of each run without a prior is stochastic, but
    fixed where the log measures it.
    """
    if declared.std is not None:
        return "state" if declared.per_run else "shape"
    if declared.per_run:
        return "stochastic" if declared.measured is None else "fixed"
    return "size" if declared.plausible != declared.neutral else "fixed"


def _unknown(name: str, declared: EffectParameter) -> Unknown:
    return Unknown(
        name=name,
        start=declared.plausible,
        lower=declared.lower,
        upper=declared.upper,
        logarithmic=False,
        scale=declared.std or abs(declared.plausible - declared.neutral) or 1.0,
        prior=declared.plausible,
        std=declared.std,
        step=declared.step,
        angle=declared.angle,
    )
