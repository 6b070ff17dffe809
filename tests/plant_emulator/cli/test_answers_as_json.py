"""A JSON answer is valid JSON, whatever its numbers."""

import json
from pathlib import Path

import numpy as np
import pytest

from plant_emulator.cli._options import write_json


def refuse(constant: str) -> None:
    """JSON has neither NaN nor Infinity: RFC 8259, section 6."""
    raise AssertionError(constant)


def test_numbers_that_json_has_not_are_null(tmp_path: Path) -> None:
    answer = {
        "interval": [float("nan"), 0.9],
        "errors": ({"value": np.float64("inf")}, {"value": 0.5}),
        "converged": True,
    }
    write_json(answer, str(tmp_path / "answer.json"))
    read = json.loads((tmp_path / "answer.json").read_text(), parse_constant=refuse)
    assert read == {
        "interval": [None, 0.9],
        "errors": [{"value": None}, {"value": 0.5}],
        "converged": True,
    }


def test_what_is_no_json_at_all_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError):
        write_json({"value": {1, 2}}, str(tmp_path / "answer.json"))
