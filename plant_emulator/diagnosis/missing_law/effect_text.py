"""A drafted law as the text of an effect file; see `plant_emulator.effects` for the form."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.diagnosis.missing_law.grammar import Factor, Term
    from plant_emulator.diagnosis.missing_law.law_search import Law

# Largest size of a coefficient [that of the draft].
LARGEST_SIZE = 5.0
# Prior standard deviation of a width or a time constant, and its bounds [that of the draft].
SHAPE_STD, SHAPE_FACTOR = 0.5, 10.0
# The same of a multiple of an angle: the speed behind it is known to some per mille.
MULTIPLE_STD, MULTIPLE_FACTOR = 0.005, 1.02
# Laws against the motion that have a Coulomb and a viscous part, by the law of the Coulomb part.
VISCOUS = {
    "drum_coulomb_friction": "drum_viscous_friction",
    "motor_coulomb_friction": "motor_viscous_friction",
}
# Speed below which a viscous coefficient stays that of this speed [rad/s].
SLOWEST_SPEED = 1e-3

TEXT = '''"""A drafted law of the {name}: {states}.

    {formula} [{unit}]

Source: drafted by `diagnose` from logs whose cause no effect of the library is. The law closes the
gap of runs that it was not fitted to; it is no physics until somebody says which.
"""

from math import copysign, cos, exp, sqrt

from plant_emulator.effects import EffectParameter, Memory

SUBSYSTEM = "{place}"
PARAMETERS = {{
{parameters}}}

{memories}
{laws}'''


# The phase of an angle at the start of a run, anywhere on the circle.
PHASE = """    "phase{here}": EffectParameter(
        neutral=0.0, lower=-6.3, upper=6.3, plausible=0.0, unit="rad", meaning="phase",
        per_run=True, std=1.81,
    ),
"""


def effect_text(name: str, law: Law) -> str:
    """Text of the effect file NAME.py of a law."""
    return TEXT.format(
        name=law.quantity.name,
        states="by " + ", ".join(law.over) if law.over else "a constant",
        formula=formula(law),
        unit=law.quantity.unit,
        place=law.quantity.place,
        parameters="".join(_parameters(law)),
        memories=_memories(name, law),
        laws="\n\n".join(_laws(name, law)) + "\n",
    )


def formula(law: Law) -> str:
    """The law with letters in place of its coefficients."""
    parts = []
    for k, term in enumerate(law.terms, 1):
        parts.append(f"a{k} {term.text}".strip())
    return " + ".join(parts)


def _parameters(law: Law) -> list[str]:
    found = []
    for k, (term, size) in enumerate(zip(law.terms, law.coefficients, strict=True), 1):
        bound = LARGEST_SIZE * abs(size)
        found.append(
            f'    "a{k}": EffectParameter(\n'
            f"        neutral=0.0, lower={-bound:.4g}, upper={bound:.4g}, plausible={size:.4g},\n"
            f'        unit="{unit_of(law, term)}", meaning="a{k}",\n    ),\n'
        )
        for j, factor in enumerate(term.factors, 1):
            if factor.function in {"bell", "delay", "lag", "play"}:
                unit = "s" if factor.function in {"delay", "lag"} else factor.state.unit
                found.append(_shape(k, j, factor, unit, SHAPE_STD, SHAPE_FACTOR))
            elif factor.function == "turn":
                found.append(_shape(k, j, factor, "1", MULTIPLE_STD, MULTIPLE_FACTOR))
                found.append(PHASE.format(here=f"{k}{j}"))
    return found


def unit_of(law: Law, term: Term) -> str:
    """Unit of a term's coefficient: that of the quantity over those of the factors."""
    powers = {"linear": "{}", "size": "{}", "delay": "{}", "lag": "{}", "square": "({})^2"}
    powers |= {"root": "({})^0.5", "play": "{}"}
    below = [
        powers[factor.function].format(factor.state.unit)
        for factor in term.factors
        if factor.state.unit and factor.function in powers
    ]
    return f"{law.quantity.unit}/({' '.join(below)})" if below else law.quantity.unit


def _shape(k: int, j: int, factor: Factor, unit: str, std: float, most: float) -> str:
    """Parameter of a factor's scale; std : its prior deviation, and most : its bounds' factor."""
    b = factor.scale
    return (
        f'    "b{k}{j}": EffectParameter(\n'
        f"        neutral={b:.6g}, lower={b / most:.6g}, upper={b * most:.6g},\n"
        f'        plausible={b:.6g}, unit="{unit}", meaning="b{k}{j}", std={std * b:.4g},\n'
        "    ),\n"
    )


def _memories(name: str, law: Law) -> str:
    """Memories of the lags and the angles in a law."""
    parts, table = [], []
    for k, term in enumerate(law.terms, 1):
        for j, factor in enumerate(term.factors, 1):
            text = _advance(name, f"{k}{j}", factor)
            if not text:
                continue
            parts.append(text)
            follows = factor.function in {"delay", "play"}
            hook = f', follows="{law.quantity.hook}"' if follows else ""
            table.append(f'    "memory{k}{j}": Memory(start{k}{j}, advance{k}{j}{hook}),\n')
    return "\n".join(parts) + ("\n\nMEMORIES = {\n" + "".join(table) + "}\n" if table else "")


def _advance(name: str, here: str, factor: Factor) -> str:
    """Start and implicit stage of the memory of a factor; empty: it has none."""
    state = factor.state
    if factor.function == "turn":
        return (
            f"\ndef start{here}(p):\n    return 0.0\n\n\n"
            f"def advance{here}(base, a, s, p):\n    return base + a * {state.code}\n"
        )
    if factor.function == "play":
        half = f"p.{name}_b{here}"
        return (
            f"\ndef start{here}(p):\n    return 0.0\n\n\n"
            f"def advance{here}(base, a, value, s, p):\n"
            f"    return max(value - {half}, min(value + {half}, base))\n"
        )
    if factor.function not in {"delay", "lag"}:
        return ""
    follows = factor.function == "delay"
    return (
        f"\ndef start{here}(p):\n    return {state.start}\n\n\n"
        f"def advance{here}(base, a, {'value, ' if follows else ''}s, p):\n"
        f"    x = {'value' if follows else state.code}\n"
        f"    return x + (base - x) * p.{name}_b{here} / (p.{name}_b{here} + a)\n"
    )


def _laws(name: str, law: Law) -> list[str]:
    """Functions of the laws that the effect changes."""
    hook, numbered = law.quantity.hook, list(enumerate(law.terms, 1))
    absent = " and ".join(f"p.{name}_a{k} == 0.0" for k, _ in numbered)
    if hook == "gear_speed_friction" and any("torque" in state for state in law.over):
        hook = "gear_load_friction"
    if hook not in VISCOUS:
        total = " + ".join(_product(name, k, term) for k, term in numbered)
        return [_function(hook, absent, f"value + {total}")]
    speed = law.quantity.states[0]
    moving = [(k, term) for k, term in numbered if _vanishes(term)]
    resting = [(k, term) for k, term in numbered if not _vanishes(term)]
    found = []
    if resting:
        total = " + ".join(_product(name, k, term) for k, term in resting)
        found.append(_function(hook, absent, f"max(0.0, value + {total})"))
    if moving:
        total = " + ".join(_product(name, k, term) for k, term in moving)
        found.append(
            _function(
                VISCOUS[hook], absent, f"value + ({total}) / max({speed.code}, {SLOWEST_SPEED})"
            )
        )
    return found


def _vanishes(term: Term) -> bool:
    """Whether a friction term vanishes where its speed does."""
    return any(
        f.state.kind == "level" and f.function in {"linear", "square", "root"} for f in term.factors
    )


def _function(hook: str, absent: str, value: str) -> str:
    return f"\ndef {hook}(value, s, p):\n    if {absent}:\n        return value\n    return {value}"


def _product(name: str, k: int, term: Term) -> str:
    factors = [_code(name, f"{k}{j}", f) for j, f in enumerate(term.factors, 1)]
    return " * ".join([f"p.{name}_a{k}", *factors])


def _code(name: str, here: str, factor: Factor) -> str:
    x, b = f"({factor.state.code})", f"p.{name}_b{here}"
    if factor.state.kind == "level" and factor.function in {"square", "root"}:
        return f"{x} * {x}" if factor.function == "square" else f"sqrt{x}"
    return {
        "linear": x,
        "size": f"abs{x}",
        "square": f"{x} * abs{x}",
        "root": f"copysign(sqrt(abs{x}), {x})",
        "sign": f"(1.0 if {x} > 0.0 else -1.0 if {x} < 0.0 else 0.0)",
        "bell": f"exp(-({x} / {b}) * ({x} / {b}))",
        "delay": f"(s.{name}_memory{here} - value)",
        "play": f"(s.{name}_memory{here} - value)",
        "lag": f"s.{name}_memory{here}",
        "turn": f"cos({b} * s.{name}_memory{here} + p.{name}_phase{here})",
    }[factor.function]
