"""An emulated roller bench with its drive and its PLC, and the analysis of its logs.

    import plant_emulator as pe

    log = pe.simulate("program1", effects={"torque_sensor_lag": {"time_constant": 0.1}}, seed=1)
    log["motor_speed"]                        # [rad/s], shape (samples,)
    found = pe.diagnose(["run1.csv", "run2.csv"])

All values are SI. Files carry units in the names of their columns. An error in what you give is an
`InputError`; its message names place, value and what would be right. A module is loaded when one of
its names is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plant_emulator import effects
    from plant_emulator.effects import Effect, EffectParameter
    from plant_emulator.errors import (
        DiagnosisError,
        EmulatorError,
        IdentificationError,
        InputError,
        LogError,
        ParameterError,
        UnsettledError,
    )
    from plant_emulator.logs import read as read_log
    from plant_emulator.logs import write as write_log
    from plant_emulator.model.parameters import Parameter, ParameterSet
    from plant_emulator.parameter_sets import save as save_parameters
    from plant_emulator.parameter_sets.with_effects import load as load_parameters
    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Log
    from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram
    from plant_emulator.workflows.axis_reader import read as read_axis_log
    from plant_emulator.workflows.detectability import Detectability, detectability
    from plant_emulator.workflows.diagnosis.diagnose import Diagnosis, diagnose
    from plant_emulator.workflows.identification import IdentificationResult, identify
    from plant_emulator.workflows.simulation import simulate
    from plant_emulator.workflows.truck_identification import (
        TruckIdentification,
        identify_coast_down,
        identify_truck,
    )
    from plant_emulator.workflows.validation import ValidationResult, validate

# Where each public name stands: module, and its name there. The imports above say the same to type
# checkers and editors.
_PLACES: dict[str, tuple[str, str]] = {
    "AxisLog": ("plant_emulator.signals.axis_log", "AxisLog"),
    "Detectability": ("plant_emulator.workflows.detectability", "Detectability"),
    "Diagnosis": ("plant_emulator.workflows.diagnosis.diagnose", "Diagnosis"),
    "DiagnosisError": ("plant_emulator.errors", "DiagnosisError"),
    "Effect": ("plant_emulator.effects", "Effect"),
    "EffectParameter": ("plant_emulator.effects", "EffectParameter"),
    "EmulatorError": ("plant_emulator.errors", "EmulatorError"),
    "IdentificationError": ("plant_emulator.errors", "IdentificationError"),
    "IdentificationResult": ("plant_emulator.workflows.identification", "IdentificationResult"),
    "InputError": ("plant_emulator.errors", "InputError"),
    "Log": ("plant_emulator.signals.log", "Log"),
    "LogError": ("plant_emulator.errors", "LogError"),
    "PROGRAMS": ("plant_emulator.simulation.programs", "PROGRAMS"),
    "Parameter": ("plant_emulator.model.parameters", "Parameter"),
    "ParameterError": ("plant_emulator.errors", "ParameterError"),
    "ParameterSet": ("plant_emulator.model.parameters", "ParameterSet"),
    "SpeedProgram": ("plant_emulator.simulation.programs", "SpeedProgram"),
    "TruckIdentification": ("plant_emulator.workflows.truck_identification", "TruckIdentification"),
    "UnsettledError": ("plant_emulator.errors", "UnsettledError"),
    "ValidationResult": ("plant_emulator.workflows.validation", "ValidationResult"),
    "detectability": ("plant_emulator.workflows.detectability", "detectability"),
    "diagnose": ("plant_emulator.workflows.diagnosis.diagnose", "diagnose"),
    "identify": ("plant_emulator.workflows.identification", "identify"),
    "identify_coast_down": (
        "plant_emulator.workflows.truck_identification",
        "identify_coast_down",
    ),
    "identify_truck": ("plant_emulator.workflows.truck_identification", "identify_truck"),
    "load_parameters": ("plant_emulator.parameter_sets.with_effects", "load"),
    "read_axis_log": ("plant_emulator.workflows.axis_reader", "read"),
    "read_log": ("plant_emulator.logs", "read"),
    "save_parameters": ("plant_emulator.parameter_sets", "save"),
    "simulate": ("plant_emulator.workflows.simulation", "simulate"),
    "validate": ("plant_emulator.workflows.validation", "validate"),
    "write_log": ("plant_emulator.logs", "write"),
}

__all__ = [
    "PROGRAMS",
    "AxisLog",
    "Detectability",
    "Diagnosis",
    "DiagnosisError",
    "Effect",
    "EffectParameter",
    "EmulatorError",
    "IdentificationError",
    "IdentificationResult",
    "InputError",
    "Log",
    "LogError",
    "Parameter",
    "ParameterError",
    "ParameterSet",
    "SpeedProgram",
    "TruckIdentification",
    "UnsettledError",
    "ValidationResult",
    "detectability",
    "diagnose",
    "effects",
    "identify",
    "identify_coast_down",
    "identify_truck",
    "load_parameters",
    "read_axis_log",
    "read_log",
    "save_parameters",
    "simulate",
    "validate",
    "write_log",
]


def __getattr__(name: str) -> Any:
    """Load the module of a public name at its first use (PEP 562)."""
    if name == "effects":
        return import_module("plant_emulator.effects")
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, attribute = _PLACES[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return __all__
