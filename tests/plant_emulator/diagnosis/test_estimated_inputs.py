"""An input that nobody measured is drawn with its band, and the sampling of each log is told."""

import re
from dataclasses import replace

import numpy as np

from plant_emulator.diagnosis.report.details import EstimatedInput
from plant_emulator.diagnosis.report.document import from_json
from plant_emulator.diagnosis.report.html.page import html
from plant_emulator.workflows.diagnosis.runs import describe_sampling
from tests.plant_emulator.diagnosis import answers

TIME = np.linspace(0.0, 30.0, 301)
TORQUE = EstimatedInput(
    source="truck.csv",
    name="wheel torque",
    unit="N m",
    time=TIME,
    value=400.0 * np.sin(TIME / 5.0),
    deviation=np.full(301, 30.0),
)


def test_estimated_torque_is_drawn_with_both_edges_of_its_band() -> None:
    page = html(from_json(answers.effect()), replace(answers.DETAILS, inputs=(TORQUE,)))
    (section,) = re.findall(r"<h2>Inputs that nobody measured</h2>.*?</section>", page, re.DOTALL)
    assert "wheel torque of truck.csv [N m]: estimated, nobody measured it" in section
    assert section.count("<path") == 3


def test_a_report_without_such_an_input_has_no_such_section() -> None:
    page = html(from_json(answers.effect()), answers.DETAILS)
    assert "Inputs that nobody measured" not in page


def test_sampling_of_a_log_is_told_with_what_was_skipped() -> None:
    """A hundred samples every 10 ms, of which three were not seen: one alone, two together."""
    time = np.delete(0.01 * np.arange(101), [20, 50, 51])
    assert (
        describe_sampling(time) == "every 10 ms 97.9 %, 20 ms 1.0 %, 30 ms 1.0 %; 3 samples skipped"
    )
