"""What blind trials taught: how often answers are right, and how far off sizes are."""

from __future__ import annotations

import csv
from pathlib import Path

from plant_emulator import effects
from plant_emulator.diagnosis import calibration
from plant_emulator.diagnosis.calibration.confidence import TrialVerdict
from plant_emulator.diagnosis.calibration.model_form_error import EstimatedSize, model_form_errors

FOLDER = Path(calibration.__file__).parent


def trial_cases() -> list[TrialVerdict]:
    """The cases of the blind trial that this version was calibrated with."""
    return [
        TrialVerdict(
            kind=row["kind"],
            log_odds=float(row["log_odds"]),
            right=row["right"] == "True",
        )
        for row in _rows("calibration.csv")
    ]


def load_model_form_errors() -> dict[str, float]:
    """Read the table of model-form errors; give the relative error of every size by name."""
    numbers = ("true", "estimated", "standard_error")
    return model_form_errors(
        [
            EstimatedSize(
                name=f"{row['effect']}_{row['parameter']}",
                plausible=_plausible(row["effect"], row["parameter"]),
                **{key: float(row[key]) for key in numbers},
            )
            for row in _rows("law_errors.csv")
        ]
    )


def _rows(name: str) -> list[dict[str, str]]:
    with (FOLDER / name).open(newline="") as file:
        return list(csv.DictReader(file))


def _plausible(effect: str, parameter: str) -> float:
    """Distance of an effect's plausible size from neutral [its unit]."""
    declared = effects.load(effect).parameters[parameter]
    return abs(declared.plausible - declared.neutral)
