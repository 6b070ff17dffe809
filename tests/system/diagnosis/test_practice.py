"""The whole library on logs of the independent bench that need none of it."""

import json
from pathlib import Path

import pytest

from tests.system.diagnosis.conftest import plant_emulator

CASES = Path(__file__).parents[2] / "data" / "bench_practice"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "kind"),
    [
        ("practice_002", "parameter"),  # every parameter off, by up to 16 %
        ("practice_004", "none"),
    ],
)
def test_no_effect_is_named_where_there_is_none(case: str, kind: str) -> None:
    logs = [CASES / case / f"program{k}.csv.gz" for k in (1, 2, 3)]
    done = plant_emulator("diagnose", *logs, "--json", "-")
    assert done.returncode == 0, done.stderr
    verdict = json.loads(done.stdout)["verdict"]
    assert (verdict["kind"], verdict["effects"]) == (kind, [])
