"""tools/mutate.py tries what it says, and only on modules and tests that are there."""

import ast
from importlib.util import find_spec
from pathlib import Path

import pytest

from tools import mutate

SOURCE = '''"""Text 1."""

LIMIT: Final = 2.5


def is_low(value: float) -> bool:
    """Text 2."""
    return value < LIMIT and True
'''


@pytest.mark.parametrize("module", mutate.TARGETS)
def test_every_module_and_its_tests_are_there(module: str) -> None:
    assert find_spec(module) is not None
    assert all((mutate.ROOT / tests).is_file() for tests in mutate.TARGETS[module])


def test_comparison_number_truth_and_operator_are_changed_and_texts_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "limits.py").write_text(SOURCE)
    monkeypatch.setattr(mutate, "ROOT", tmp_path)
    found = {(one.was, one.now) for one in mutate.mutants("limits")}
    assert found == {
        ("2.5", "3.5"),
        ("2.5", "1.5"),
        ("value < LIMIT", "value <= LIMIT"),
        ("value < LIMIT", "value >= LIMIT"),
        ("True", "False"),
        ("value < LIMIT and True", "value < LIMIT or True"),
    }
    unchanged = ast.dump(ast.parse(SOURCE))
    assert all(ast.dump(one.tree) != unchanged for one in mutate.mutants("limits"))
