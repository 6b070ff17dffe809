"""Pictures of the spectrum of each channel's residual, with the noise model over it."""

from __future__ import annotations

from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.report.html.chart import chart
from plant_emulator.diagnosis.report.html.markup import Markup, join, tag
from plant_emulator.diagnosis.wording import in_words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.noise.spectra import Spectrum


def noise_spectra(found: Sequence[Spectrum]) -> Markup:
    """A figure of each channel."""
    return join(*(_figure(one) for one in found))


def _figure(one: Spectrum) -> Markup:
    words = (
        f"{in_words(one.channel)}: power spectral density of the residual [({one.unit})^2/Hz]; the "
        "dashed curve is the noise model"
    )
    if one.lines:
        words += f", hum at {', '.join(f'{f:.2f} Hz' for f in one.lines)}"
    curves = ((np.log10(one.left), "after"), (np.log10(one.noise), "before"))
    both = np.concatenate([values for values, _ in curves])
    labels = {
        f"1e{power}": float(power) for power in range(floor(both.min()), ceil(both.max()) + 1)
    }
    drawn = chart(words, "frequency [Hz]", one.frequency, curves, labels, one.lines)
    return tag("figure", tag("figcaption", words), drawn)
