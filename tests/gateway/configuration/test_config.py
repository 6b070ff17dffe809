"""Configuration: what a file may say, and how each mistake in it is named."""

import json
from pathlib import Path

import pytest

import gateway
from gateway.config_file import load, with_values
from gateway.configuration.config import Config, config_hash, from_document
from gateway.configuration.keys import keys
from gateway.configuration.sections import SECTIONS
from gateway.errors import ConfigError

EXAMPLES = Path(gateway.__file__).parent / "examples"


def written(tmp_path, text):
    file = tmp_path / "bench.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_the_example_writes_out_every_default():
    assert load(EXAMPLES / "bench.toml") == Config()


def test_the_example_names_every_key():
    text = (EXAMPLES / "bench.toml").read_text(encoding="utf-8")
    for section in SECTIONS.values():
        for key in keys(section).values():
            assert f"{key.name} = " in text


def test_an_empty_file_means_the_defaults(tmp_path):
    assert load(written(tmp_path, "")) == Config()


def test_units_of_the_file_become_si(tmp_path):
    text = """
        [loop]
        period_ms = 20
        [truck]
        grade_percent = 5
        top_speed_km_h = 18
        [limits]
        speed_max_rpm = 3000
    """
    config = load(written(tmp_path, text))
    assert config.loop.period == pytest.approx(0.02)
    assert config.truck.grade == pytest.approx(0.05)
    assert config.truck.top_speed == pytest.approx(5.0)
    assert config.limits.speed_max == pytest.approx(314.159265)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[truck]\nmas_kg = 1.0", ["bench.toml:2: [truck] mas_kg", "unknown key", "mass_kg"]),
        ("\n[trucks]\nmass_kg = 1.0", ["bench.toml:2: [trucks]", "unknown section", "truck"]),
        ("truck = 3", ["unknown section", "truck"]),
        ("[truck]\nmass_kg = 'x'", [":2: [truck] mass_kg", "wrong type", "'x'", "a number"]),
        ("[plc]\nport = true", [":2:", "wrong type", "True", "a whole number"]),
        ("[plc]\nport = 5020.0", ["wrong type", "a whole number"]),
        ("[plc]\nhost = 5", ["wrong type", "text"]),
        ("[loop]\nrealtime = 1", ["wrong type", "true or false"]),
        ("[truck]\nmass_kg = true", ["wrong type", "a number"]),
        ("[truck]\nmass_kg = nan", ["out of range", "nan", "50 .. 100000"]),
        ("[plc]\nport = 70000", ["out of range", "70000", "1 .. 65535"]),
        ("[loop]\nperiod_ms = 0", ["[loop] period_ms", "out of range", "1 .. 200"]),
        ("[limits]\nspeed_max_rpm = 5000", ["out of range", "4830"]),
        ("[regulator]\ntorque = 'mean'", ["unknown choice", "integrated or averaged"]),
        ("[truck]\nf1_N_per_m_s = 1", [":2: [truck] f1_N_per_m_s", "f0_N beside it"]),
        ("[regulator]\nfriction = 3", [":2: [regulator] friction", "no friction table"]),
        ("[regulator]\nfriction = 'none.toml'", ["none.toml", "No such file"]),
        ("[truck", ["bench.toml", "expected TOML"]),
        (f"[truck]\nmass_kg = {5000 * '9'}", ["bench.toml: a number of too many digits"]),
        (f"[truck]\nmass_kg = {5000 * '['}", ["bench.toml: arrays or tables nested too deep"]),
        ('[plc]\nmap = "a\\u0000b"', [":2: [plc] map: control character", "'a\\x00b'"]),
        ('[plc]\nmap = "a\\nb"', [":2: [plc] map: control character", "'a\\nb'"]),
        ("[plc]\nmap = ''", [":2: [plc] map: empty", "a text on one line"]),
        ('[recording]\ndir = "a\\u0000b"', [":2: [recording] dir: control character"]),
        ('[regulator]\nfriction = "a\\u0000b"', [":2: [regulator] friction: control character"]),
    ],
)
def test_a_mistake_is_named_with_file_place_value_and_what_would_be_right(tmp_path, text, said):
    with pytest.raises(ConfigError) as refused:
        load(written(tmp_path, text))
    message = str(refused.value)
    assert refused.value.exit_code == 2
    assert "\n" not in message
    assert [part for part in said if part not in message] == []


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.toml.*expected a TOML file"):
        load(tmp_path / "none.toml")


def test_a_friction_file_is_looked_for_beside_the_configuration(tmp_path):
    (tmp_path / "cold.toml").write_text("viscous = 400", encoding="utf-8")
    config = load(written(tmp_path, "[regulator]\nfriction = 'cold.toml'"))
    assert config.regulator.friction.viscous == 400.0
    assert config.regulator.friction.coulomb == 35.989


def test_the_shipped_friction_file_holds_the_thesis_values(tmp_path):
    text = f"[regulator]\nfriction = '{EXAMPLES / 'friction.toml'}'"
    assert load(written(tmp_path, text)) == Config()


def test_set_changes_one_value():
    config = Config().with_values({"truck.load_kg": "1600", "regulator.name": "thesis"})
    assert config.truck.total_mass == 5240.0
    assert config.regulator.name == "thesis"
    assert config.plc == Config().plc


def test_set_takes_a_friction_file(tmp_path):
    file = tmp_path / "cold.toml"
    file.write_text("coulomb = 50.0", encoding="utf-8")
    changed = with_values(Config(), {"regulator.friction": str(file)})
    assert changed.regulator.friction.coulomb == 50.0


def test_set_names_its_mistakes():
    with pytest.raises(ConfigError, match=r"truck\.load_kg.*wrong type.*'much'.*a number"):
        Config().with_values({"truck.load_kg": "much"})


def test_a_document_survives_json_and_makes_the_same_configuration():
    config = Config().with_values({"loop.period_ms": "20", "truck.f0_N": "418.5"})
    again = from_document(json.loads(json.dumps(config.document)))
    assert again == config
    assert config_hash(again) == config_hash(config)


def test_the_hash_tells_configurations_apart():
    assert config_hash(Config()) != config_hash(Config().with_values({"truck.load_kg": "1"}))
