"""Missing laws of an axis of which everything is known: drafted, saved, and named as an effect."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.workflows.diagnosis.diagnose import diagnose
from plant_emulator.workflows.diagnosis.draft_check import draft_check
from tests.plant_emulator.diagnosis.axis_truth import log

ASYMMETRY = 30.0


def runs(*, asymmetry: float) -> list[AxisLog]:
    return [
        replace(log(lambda _q, v, _a: asymmetry * np.abs(v), phase=phase, seed=k), source=f"{k}")
        for k, phase in enumerate((0.0, 1.0, 2.0), 1)
    ]


@pytest.mark.slow
def test_friction_by_direction_is_drafted_saved_and_named(tmp_path: Path) -> None:
    folder = tmp_path / "drafts"
    logs = runs(asymmetry=ASYMMETRY)
    found = diagnose(
        logs, model="axis", without="viscous_asymmetry", draft="unknown", draft_folder=folder
    )
    assert found.answer.verdict.kind == "unknown"
    assert found.answer.drafts
    best = found.answer.drafts[0]
    assert (best.place, best.form.split(" ", 1)[1]) == ("gear", "|v| N")
    assert float(best.form.split()[0]) == pytest.approx(ASYMMETRY, rel=0.05)
    assert best.held_out_gain is not None
    assert best.bound is not None
    assert best.held_out_gain <= best.bound
    assert best.curve.over == "velocity"

    file = Path(best.file)
    assert {Path(one.file) for one in found.answer.drafts} == {*folder.glob("*.py")}
    assert found.parameter_set.effects[file.stem]["a1"] == pytest.approx(ASYMMETRY, rel=0.05)
    assert found.parameter_set.effect_files == {file.stem: str(file)}

    checked = draft_check(file, logs, model="axis")
    assert checked.parameters[0].value == pytest.approx(ASYMMETRY, rel=0.05)
    assert checked.held_out_gain == pytest.approx(best.held_out_gain, abs=0.01)

    again = diagnose(logs, model="axis", without="viscous_asymmetry", effect_files=file)
    assert again.answer.verdict.effects == (file.stem,)


@pytest.mark.slow
def test_axis_without_a_gap_has_no_draft_even_if_one_is_wanted(tmp_path: Path) -> None:
    found = diagnose(
        runs(asymmetry=0.0), model="axis", draft="always", draft_folder=tmp_path / "drafts"
    )
    assert found.answer.verdict.kind == "none"
    assert found.answer.drafts == ()
    assert not [*(tmp_path / "drafts").glob("*.py")]
