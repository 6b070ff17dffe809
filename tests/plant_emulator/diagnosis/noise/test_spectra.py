"""Spectra of the channels, against scipy's and against the variance of known noise."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch as welch_by_scipy

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.noise.spectra import SEGMENT_SAMPLES, spectra, welch
from plant_emulator.diagnosis.report.document import from_json
from plant_emulator.diagnosis.report.html.page import html
from tests.plant_emulator.diagnosis import answers
from tests.plant_emulator.diagnosis.line import TIME, Line, noisy


def test_density_is_that_of_scipy() -> None:
    series = np.random.default_rng(0).standard_normal(1000)
    _, expected = welch_by_scipy(series, 100.0, nperseg=SEGMENT_SAMPLES, detrend="constant")
    assert np.allclose(welch(series, 0.01), expected)


def test_both_spectra_of_white_noise_hold_its_variance() -> None:
    model = Line([noisy(2.0 + 3.0 * TIME)])
    (one,) = spectra(model, fit_null(model, (0,)), (0,), {})
    width = float(one.frequency[1] - one.frequency[0])
    assert width * one.left.sum() == pytest.approx(1.0, abs=0.2)
    assert width * one.noise.sum() == pytest.approx(1.0, abs=0.02)


def test_report_draws_residual_and_noise_model() -> None:
    model = Line([noisy(2.0 + 3.0 * TIME)])
    drawn = spectra(model, fit_null(model, (0,)), (0,), {})
    page = html(from_json(answers.effect()), replace(answers.DETAILS, spectra=drawn))
    figures = re.findall(r"<figure><figcaption>y: power spectral.*?</figure>", page, re.DOTALL)
    assert [figure.count("<path") for figure in figures] == [2]
