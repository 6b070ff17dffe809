"""The board of Grafana asks for metrics that there are."""

import json
import re
from itertools import combinations
from pathlib import Path

import pytest
from click.testing import CliRunner

import gateway.cli
from gateway.monitoring.metrics import families
from tests.gateway.monitoring.identities import IDENTITY
from tests.gateway.monitoring.test_block import good, shown


@pytest.fixture
def board(tmp_path: Path) -> dict:
    config = tmp_path / "bench.toml"
    config.write_text("[plc]\nport = 502\n")
    result = CliRunner().invoke(gateway.cli.main, ["install", "-c", str(config), "--board"])
    assert result.exit_code == 0
    return json.loads(result.stdout)


def test_every_query_names_metrics_and_labels_that_the_gateway_has(board: dict) -> None:
    samples = [s for one in families(IDENTITY, shown(good(0)), 0.0) for s in one.samples]
    queries = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
    named = {name for query in queries for name in re.findall(r"gateway_\w+", query)}
    assert named <= {sample.name for sample in samples}
    assert len(named) > 15
    labels = {label for sample in samples for label in sample.labels}
    shown_labels = {
        label
        for panel in board["panels"]
        for target in panel["targets"]
        for label in re.findall(r"{{(\w+)}}", target["legendFormat"])
    }
    assert shown_labels <= labels


def test_panels_have_their_own_place(board: dict) -> None:
    assert len({panel["id"] for panel in board["panels"]}) == len(board["panels"])
    places = [panel["gridPos"] for panel in board["panels"]]
    assert all(one["x"] + one["w"] <= 24 for one in places)
    for one, other in combinations(places, 2):
        beside = one["x"] + one["w"] <= other["x"] or other["x"] + other["w"] <= one["x"]
        below = one["y"] + one["h"] <= other["y"] or other["y"] + other["h"] <= one["y"]
        assert beside or below
