"""The memory of the learned regulator as a table or a file of the configuration."""

import pytest

from gateway.config_file import load, with_values
from gateway.configuration.config import Config, from_document
from gateway.configuration.memory import Crossing, Memory
from gateway.errors import ConfigError

MEMORY = Memory(
    duration=24.0,
    crossings=(Crossing(time=19.9, direction=1.0, delay=0.07, best=0.07, cost=0.003, step=0.03),),
)
TEXT = """duration = 24.0
[[crossings]]
time = 19.9
direction = 1
delay = 0.07
best = 0.07
cost = 0.003
step = 0.03
"""


def test_a_memory_is_read_from_a_file_beside_the_configuration(tmp_path):
    (tmp_path / "cycle.toml").write_text(TEXT, "utf-8")
    (tmp_path / "bench.toml").write_text('[regulator]\nlearned = "cycle.toml"\n', "utf-8")
    found = load(tmp_path / "bench.toml")
    assert found.regulator.learned == MEMORY
    assert from_document(found.document) == found
    path = str(tmp_path / "cycle.toml")
    assert with_values(Config(), {"regulator.learned": path}).regulator.learned == MEMORY


@pytest.mark.parametrize(
    ("table", "told"),
    [
        (3, "no memory"),
        ({"duration": 24.0}, "expected duration and crossings"),
        ({"duration": 24.0, "crossings": 3}, "expected a list of tables"),
        ({"duration": "long", "crossings": []}, r"learned\.duration.*'long'.*a finite number"),
        ({"duration": float("nan"), "crossings": []}, "a finite number"),
        ({"duration": 24.0, "crossings": [{"time": 1.0}]}, "no crossing.*time, direction"),
        (
            {"duration": 24.0, "crossings": [MEMORY.document["crossings"][0] | {"direction": 0}]},
            r"crossings\.direction.*1 or -1",
        ),
    ],
)
def test_what_is_no_memory_is_refused(table, told):
    with pytest.raises(ConfigError, match=told):
        Config().with_values({"regulator.learned": table})


def test_a_file_that_holds_no_memory_is_refused_by_its_name(tmp_path):
    path = tmp_path / "cycle.toml"
    path.write_text("duration = nan\ncrossings = []\n", "utf-8")
    with pytest.raises(ConfigError, match=r"cycle\.toml: memory\.duration: bad value, found nan"):
        with_values(Config(), {"regulator.learned": str(path)})


def test_a_memory_without_a_crossing_is_written_as_it_is_read(tmp_path):
    path = tmp_path / "cycle.toml"
    path.write_text(Memory(duration=3.0).toml, "utf-8")
    found = with_values(Config(), {"regulator.learned": str(path)})
    assert found.regulator.learned == Memory(duration=3.0)
