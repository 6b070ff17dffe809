"""What the options of `diagnose` ask for."""

from typing import Any

import pytest
from click.testing import CliRunner

from plant_emulator.cli import main
from plant_emulator.errors import InputError
from plant_emulator.workflows.diagnosis import diagnose


@pytest.mark.parametrize(
    ("words", "draft"), [([], "unknown"), (["--draft"], "always"), (["--no-draft"], "never")]
)
def test_law_is_drafted_where_the_cause_is_unknown_unless_told_otherwise(
    words: list[str], draft: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}

    def refuse(*_: Any, **options: Any) -> None:
        asked.update(options)
        raise InputError("far enough")

    monkeypatch.setattr(diagnose, "diagnose", refuse)
    assert CliRunner().invoke(main, ["diagnose", "a.csv", *words]).exit_code == 2
    assert asked["draft"] == draft
