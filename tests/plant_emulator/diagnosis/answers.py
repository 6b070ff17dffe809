"""Answers of `diagnose` written by hand, one of each kind, and what a report draws beside them."""

from dataclasses import replace
from typing import Any

import numpy as np

from plant_emulator.diagnosis.prediction.trace import Trace
from plant_emulator.diagnosis.report.details import Details, Step

CHANNELS = {"motor_speed": "rad/s", "drum_speed": "rad/s", "armature_current": "A",
            "shaft_torque": "N m"}  # fmt: skip
NOMINAL = {
    "motor_speed": 0.0041, "drum_speed": 0.0052, "armature_current": 0.061, "shaft_torque": 0.044
}  # fmt: skip
RECALIBRATED = {
    "motor_speed": 0.0021, "drum_speed": 0.0032, "armature_current": 0.034, "shaft_torque": 0.027
}  # fmt: skip
EXPLAINED = {
    "motor_speed": 0.00033, "drum_speed": 0.0013, "armature_current": 0.009, "shaft_torque": 0.0052
}  # fmt: skip
FLOOR = {
    "motor_speed": 0.0003, "drum_speed": 0.0012, "armature_current": 0.008, "shaft_torque": 0.005
}  # fmt: skip
PHASES = (
    "standstill", "breakaway", "acceleration", "cruise", "deceleration", "field_weakening"
)  # fmt: skip
TRACE = [
    {"action": "confirmed", "effects": ["gear_oil_temperature"],
     "promised": {"simulation": 380.2, "relations": 401.7}, "gain": 406.2, "mean_square": 1.01},
    {"action": "converged", "effects": ["gear_oil_temperature"], "promised": {}, "gain": 406.4,
     "mean_square": 1.0},
]  # fmt: skip
NOISE = [
    {"channel": "armature_current", "deviation": 0.25, "correlation_time": 0.03,
     "lines": [50.02, 100.04], "outliers": 0.003, "held_period": 0.0, "white": True},
    {"channel": "shaft_torque", "deviation": 0.3, "correlation_time": 0.01, "lines": [],
     "outliers": 0.0, "held_period": 0.02, "white": False},
]  # fmt: skip
HIDDEN = [
    {
        "effect": "armature_resistance_heating",
        "reason": "hidden by the current loop; log armature_voltage_V",
    },
    {"effect": "wheel_slip", "reason": "no truck on the drum in these logs"},
    {"effect": "tyre_rolling_loss", "reason": "no truck on the drum in these logs"},
    {"effect": "friction_asymmetry", "reason": "no run in reverse"},
]


def parameter(name: str, value: float, error: float | None, unit: str) -> dict[str, Any]:
    """A parameter of a ranked effect."""
    return {"name": name, "value": value, "standard_error": error, "unit": unit}


def ranked(effect: str, subsystem: str, evidence: float, **more: Any) -> dict[str, Any]:
    """An entry of the ranking, not accepted unless told."""
    size = [parameter(f"{effect}_size", 0.0312, 0.0021, "1")]
    entry = {"effect": effect, "subsystem": subsystem, "evidence": evidence}
    return {**entry, "held_out_gain": 0.01, "parameters": size, "accepted": False, **more}


OIL = ranked(
    "gear_oil_temperature", "gear", 812.4, held_out_gain=0.71, accepted=True,
    parameters=[
        parameter("gear_oil_temperature_viscosity_coefficient", 0.02134, 0.00041, "1/K"),
        parameter("gear_oil_temperature_nominal_temperature", 311.2, 2.3, "K"),
    ],
)  # fmt: skip
LAG = ranked(
    "torque_sensor_lag", "torque_sensor", 214.2, held_out_gain=0.18, accepted=True,
    parameters=[parameter("torque_sensor_lag_time_constant", 0.1013, 0.0024, "s")],
)  # fmt: skip
RUNNERS_UP = [
    ranked("stribeck", "gear", 31.7),
    ranked("load_dependent_gear_loss", "gear", 12.1, held_out_gain=-0.02),
    ranked("drum_bearing_friction", "drum", 8.4),
    ranked("motor_friction", "motor", 5.0),
    ranked("armature_reaction", "motor", 0.4),
]
INERTIA = {
    "name": "drum_inertia", "nominal": 312.69, "estimated": 340.1, "standard_error": 1.2,
    "unit": "kg m^2",
}  # fmt: skip


def place() -> dict[str, Any]:
    """Where, with every cell of the map."""
    cells = [
        {"channel": c, "phase": p, "gap": 0.25 * (1.0 + 0.4 * i * j), "noise": 0.25}
        for i, c in enumerate(CHANNELS)
        for j, p in enumerate(PHASES)
    ]
    return {
        "subsystem": "gear",
        "channel": "armature_current",
        "phase": "field_weakening",
        "subsystems": [
            {"name": "gear", "share": 0.81},
            {"name": "drive", "share": 0.12},
            {"name": "drum", "share": 0.07},
        ],
        "map": cells,
    }


def effect() -> dict[str, Any]:
    """One effect is needed and sufficient; a second one cannot be told from it."""
    return {
        "schema": "gap-diagnosis/1",
        "logs": {"estimation": ["program1.csv.gz", "program2.csv.gz"],
                 "held_out": ["program3.csv.gz"]},
        "verdict": {
            "kind": "effect",
            "effects": ["gear_oil_temperature"],
            "class": [["gear_oil_temperature", "friction_asymmetry"]],
            "parameters": [INERTIA],
            "confidence": 0.98,
            "statement": "The friction of the gear falls as its oil warms "
            "(gear_oil_temperature); with it the model follows the held-out run to the noise.",
            "next_experiment": "drive program1 in reverse from a cold start: it separates "
            "gear_oil_temperature from friction_asymmetry",
            "log_odds": 29.5,
        },
        "location": place(),
        "gap": {
            "nominal": NOMINAL,
            "recalibrated": RECALIBRATED,
            "explained": EXPLAINED,
            "noise_floor": FLOOR,
            "closed_fraction": 0.98,
            "closed_fraction_ci95": [0.96, 0.99],
        },
        "ranking": [OIL, *RUNNERS_UP],
        "undetectable": HIDDEN,
        "trace": TRACE,
        "noise": NOISE,
    }  # fmt: skip


def two_effects() -> dict[str, Any]:
    """Two effects, each with a class, and a long statement: the longest answer."""
    answer = effect()
    answer["verdict"] |= {
        "effects": ["gear_oil_temperature", "torque_sensor_lag"],
        "class": [
            ["gear_oil_temperature", "friction_asymmetry", "load_dependent_gear_loss"],
            ["torque_sensor_lag", "shaft_damping", "drum_speed_lag"],
        ],
        "parameters": [
            {**INERTIA, "name": name}
            for name in ("drum_inertia", "gear_coulomb_friction", "drum_shaft_damping")
        ],
        "statement": "Two effects are needed: " + "the friction of the gear falls as its oil "
        "warms (gear_oil_temperature), and the torque sensor follows late (torque_sensor_lag); "
        "neither of them alone brings the held-out runs down to the noise of the sensors, and "
        "no third one is called for by what is left.",
        "next_experiment": "drive program1 in reverse from a cold start, then twice more warm; "
        "log armature_voltage_V; " + "and keep the shell temperature in the log; " * 3,
    }
    answer["ranking"] = [OIL, LAG, *RUNNERS_UP]
    return answer


def other_values() -> dict[str, Any]:
    """Answer of logs that the nominal equations explain with other values."""
    answer = effect()
    answer["verdict"] |= {
        "kind": "parameter",
        "effects": [],
        "class": [],
        "statement": "The drum is heavier than the set says: drum_inertia 340.1 kg m^2.",
        "next_experiment": None,
    }
    answer["gap"] |= {"recalibrated": EXPLAINED}
    answer["ranking"] = RUNNERS_UP
    return answer


def none() -> dict[str, Any]:
    """Nothing beyond the noise: nulls wherever there is nothing to say."""
    answer = effect()
    answer["verdict"] |= {
        "kind": "none",
        "effects": [],
        "class": [],
        "parameters": [],
        "statement": "The model follows these logs to the noise of their sensors.",
        "next_experiment": None,
    }
    answer["location"] = {
        "subsystem": None, "channel": None, "phase": None, "subsystems": [], "map": []
    }  # fmt: skip
    answer["gap"] |= dict.fromkeys(("nominal", "recalibrated", "explained"), FLOOR)
    answer["gap"] |= {"closed_fraction": None, "closed_fraction_ci95": None}
    answer["ranking"] = []
    answer["undetectable"] = []
    return answer


def unknown() -> dict[str, Any]:
    """A gap whose cause the library does not hold; what could not be computed is null."""
    answer = effect()
    answer["verdict"] |= {
        "kind": "unknown",
        "effects": [],
        "class": [],
        "parameters": [],
        "confidence": None,
        "statement": "There is a gap in the gear that no effect of the library explains.",
    }
    answer["location"] |= {"channel": "armature_current", "phase": None}
    answer["gap"] |= {"explained": None, "closed_fraction": None, "closed_fraction_ci95": None}
    answer["ranking"] = [
        ranked(
            "stribeck", "gear", 31.7, held_out_gain=None,
            parameters=[parameter("stribeck_rise", 12.0, None, "N m")],
        )
    ]  # fmt: skip
    return answer


def drafted() -> dict[str, Any]:
    """An unknown cause, with two drafts of the missing law."""
    curve = {
        "quantity": "friction of the gear at its output",
        "unit": "N m",
        "over": "gear speed",
        "over_unit": "rad/s",
        "knots": [0.0, 0.5, 1.0, 6.0],
        "values": [-31.0, -11.0, -4.0, 0.2],
        "band": [2.0, 1.0, 1.0, 0.5],
        "law": [-31.4, -11.5, -4.2, 0.0],
    }
    best = {
        "place": "gear",
        "quantity": "friction of the gear at its output",
        "over": "gear speed",
        "form": "-31.4 exp(-(w/0.5)^2) N m",
        "file": "drafts/draft_gear_1.py",
        "held_out_gain": 0.81,
        "held_out_gain_ci95": [0.77, 0.84],
        "bound": 0.93,
        "bound_ci95": [0.87, 0.93],
        "rivals": ["-8.2 sqrt(w) N m"],
        "curve": curve,
    }
    other = {**best, "form": "-8.2 sqrt(w) N m", "held_out_gain": 0.7, "rivals": [best["form"]]}
    return {**unknown(), "drafts": [best, {**other, "curve": {**curve, "law": None}}]}


KINDS = {
    "effect": effect,
    "two_effects": two_effects,
    "parameter": other_values,
    "none": none,
    "unknown": unknown,
    "drafted": drafted,
}


def traces(source: str = "program3.csv.gz", samples: int = 2501) -> tuple[Trace, ...]:
    """A run of two trapezoids: a lag before, noise after; the same numbers every time."""
    time = np.linspace(0.0, 50.0, samples)
    drawn = np.random.default_rng(4)
    run = np.clip(np.abs((time % 25.0) - 12.5) * -0.3 + 2.5, 0.0, 1.5)
    found = []
    for channel, unit in CHANNELS.items():
        largest = {"motor_speed": 300.0, "drum_speed": 4.8, "armature_current": 40.0}.get(
            channel, -50.0
        )
        noise = abs(largest) * 0.004
        truth = largest * run
        found.append(
            Trace(
                source=source,
                channel=channel,
                unit=unit,
                time=time,
                measured=truth + noise * drawn.standard_normal(samples),
                recalibrated=truth + 0.02 * largest * np.sin(time / 3.0),
                explained=truth + 0.0,
                noise=noise,
            )
        )
    return tuple(found)


DETAILS = Details(
    traces=traces(),
    waterfall=(
        Step(label="parameter set as given", gap=9.21, low=8.4, high=10.1),
        Step(label="recalibrated", gap=4.95, low=4.5, high=5.4),
        Step(label="with gear_oil_temperature", gap=1.08, low=1.02, high=1.15),
        Step(label="noise floor", gap=1.0, low=1.0, high=1.0),
    ),
    settings={
        "command": "plant-emulator diagnose program1.csv.gz program2.csv.gz "
        "--hold-out program3.csv.gz --report answer.html",
        "version": "0.2.0",
        "program1.csv.gz": "sha256:" + "9f86d081884c7d65" * 4,
        "threshold of the evidence": "25.0",
    },
    notes=("program2.csv.gz: armature_current repeats 7 samples from 12.3 s; left out",),
)


def with_traces(*found: Trace) -> Details:
    """Details with these traces in place of their own."""
    return replace(DETAILS, traces=found)
