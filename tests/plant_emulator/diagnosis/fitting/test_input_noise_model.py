"""A hypothesis test with noise of fed inputs, on a line with one direction fed with noise."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from plant_emulator.diagnosis.decision.procedure import Procedure
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.input_noise_model import InputNoiseRecipe, whiten_inputs
from plant_emulator.recordings.input_noise import NoiseDirections
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Given, Line, noisy, runner

# What the fed input's noise adds to every sample by its one standard deviation.
FED = np.where(TIME > 0.95, 20.0, 0.0)
NORM = float(np.linalg.norm(FED))


class Fed(Line):
    """The line, of which an input is a measurement."""

    def __init__(self, measured: Sequence[Array]) -> None:
        super().__init__(measured)
        self.runs = [replace(run, uncertain_inputs=True) for run in self.runs]

    def input_noise(
        self, run: int, where: FitResult, state: Mapping[str, float]
    ) -> NoiseDirections:
        """See `Model`."""
        return NoiseDirections(directions=csr_array(FED[None] / NORM), deviations=np.array([NORM]))


def test_fits_do_not_follow_the_noise_of_a_fed_input() -> None:
    """By hand: without the fed samples a and b are those of the line, within their errors."""
    y = noisy(2.0 + 3.0 * TIME) + FED
    model = Fed([y])
    whitened, _ = whiten_inputs(runner(model), fit_null(model, (0,)))
    there, plain = fit_null(whitened.recipe.build(), [0]), fit_null(model, [0])
    for name, value in (("a", 2.0), ("b", 3.0)):
        assert abs(there.values[name] - value) < 3.0 * there.standard_errors[name]
    assert plain.values["b"] > 4.0


def test_procedure_with_input_noise_finds_no_gap_in_their_noise() -> None:
    model = Fed([noisy(2.0 + 3.0 * TIME) + FED])
    procedure = Procedure.begin(runner(model))
    assert procedure.run()[1].kind == "unknown"
    assert procedure.with_input_noise().run()[1].kind == "parameter"


def test_fit_starts_from_the_fit_that_told_the_noise() -> None:
    """A line that is searched for once only: the second time would be a fault."""

    class Once(Fed):
        searched = False

        def start_values(
            self, runs: Sequence[int]
        ) -> tuple[dict[str, float], list[dict[str, float]]]:
            assert not self.searched
            self.searched = True
            return super().start_values(runs)

    model = Once([noisy(2.0 + 3.0 * TIME) + FED])
    procedure = Procedure.begin(runner(model))
    explained, _, _ = procedure.with_input_noise().run()
    for name, value in (("a", 2.0), ("b", 3.0)):
        assert abs(explained.null.values[name] - value) < 3.0 * explained.null.standard_errors[name]


def test_machine_that_is_fed_nothing_keeps_its_recipe() -> None:
    model = Line([noisy(2.0 + 3.0 * TIME)])
    plain, null = runner(model), fit_null(model, (0,))
    assert whiten_inputs(plain, null) == (plain, null)


def test_quieted_model_is_another_recipe() -> None:
    model = Fed([noisy(2.0 + 3.0 * TIME)])
    one = model.input_noise(0, fit_null(model, [0]), {})
    louder = replace(one, deviations=2.0 * one.deviations)
    digests = {InputNoiseRecipe(Given(model), {0: one_of}).digest() for one_of in (one, louder)}
    assert len({*digests, Given(model).digest()}) == 3
    values = {"a": 0.0, "b": 0.0}
    built = InputNoiseRecipe(Given(model), {0: one}).build()
    assert built.runs is model.runs
    assert built.residual(0, ())(values)[0, TIME <= 0.95] == pytest.approx(
        model.residual(0, ())(values)[0, TIME <= 0.95]
    )
