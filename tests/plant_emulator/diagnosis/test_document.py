"""The answer as a document: nothing is lost on the way to JSON and back."""

import json
from dataclasses import replace
from math import inf, isnan, nan

import pytest

from plant_emulator.diagnosis.report.document import from_json, to_json
from tests.plant_emulator.diagnosis import answers


@pytest.mark.parametrize("kind", ["effect", "two_effects", "parameter", "none"])
def test_document_that_was_read_is_written_as_it_was(kind: str) -> None:
    document = answers.KINDS[kind]()
    assert json.dumps(to_json(from_json(document))) == json.dumps(document)


@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_number_that_json_has_none_of_is_null_and_read_as_nan(value: float) -> None:
    answer = from_json(answers.effect())
    written = to_json(replace(answer, ranking=(replace(answer.ranking[0], evidence=value),)))
    assert json.loads(json.dumps(written, allow_nan=False))["ranking"][0]["evidence"] is None
    assert isnan(from_json(written).ranking[0].evidence)


def test_map_of_the_document_holds_the_phases_only() -> None:
    answer = from_json(answers.effect())
    other = replace(answer.location.cells[0], axis="speed", bin="0 to 25 rad/s")
    location = replace(answer.location, cells=(*answer.location.cells, other))
    written = to_json(replace(answer, location=location))
    assert written["location"]["map"] == answers.place()["map"]


def test_drafts_that_were_read_are_written_as_they_were() -> None:
    document = {**answers.effect(), "drafts": answers.drafted()["drafts"]}
    assert json.dumps(to_json(from_json(document))) == json.dumps(document)
