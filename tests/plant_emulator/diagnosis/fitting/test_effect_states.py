"""An effect with a frequency and a phase of its own in every run, on the smallest machine."""

from collections.abc import Callable, Mapping, Sequence
from math import pi

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.machine import Candidate
from plant_emulator.diagnosis.prediction.gap import Fold, predict, refit_fold
from plant_emulator.estimation.robust_scan import scan_unknowns
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, explained, linear, noisy

# One that the samples of a run of 2 s tell from others 0.5 Hz off, anywhere within 5.2 Hz.
RATE = linear("beat_rate", 0.0, scale=3.0, std=3.0, step=0.1)
PHASE = linear("beat_phase", 0.0, std=pi / 3.0**0.5, angle=True)
BEAT = Candidate(
    name="beat",
    subsystem="part of beat",
    sizes=(linear("beat_size", 1.0),),
    shapes=(),
    states=(RATE, PHASE),
    neutral={"beat_size": 0.0},
    fixed={},
    units={"beat_size": "1", "beat_rate": "Hz", "beat_phase": "rad"},
    title="The beat",
)


def wave(size: float, rate: float, phase: float) -> Array:
    """A wave in a run."""
    return size * np.cos(2.0 * pi * rate * TIME + phase)


class Beating(Line):
    """Its only effect is the beat."""

    def __init__(self, measured: Sequence[Array]) -> None:
        super().__init__(measured, ())
        self.candidates = {"beat": BEAT}

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, ())

        def residual(v: Mapping[str, float]) -> Array:
            if not effects:
                return plain(v)
            return plain(v) - wave(v["beat_size"], v["beat_rate"], v["beat_phase"])

        return residual


RUNS = ((3.37, 2.0), (-1.62, -0.7), (4.81, 0.4))


def test_beat_of_another_frequency_and_phase_in_every_run_is_found() -> None:
    """By hand: each run of 2000 samples loses 2000 0.5^2 / 2 = 250."""
    model = Beating([noisy(2.0 + wave(0.5, *own), seed) for seed, own in enumerate(RUNS)])
    final = explained(model).final
    assert final.effects == ("beat",)
    assert abs(final.values["beat_size"]) == pytest.approx(0.5, abs=0.05)
    for states, (rate, _) in zip(final.states, RUNS, strict=True):
        assert abs(states["beat_rate"]) == pytest.approx(abs(rate), abs=0.05)


@pytest.mark.slow
def test_beat_that_noise_alone_shows_is_not_named() -> None:
    """The best of some 20 frequencies takes 2 (1 + 1/2 + ... + 1/20) = 7 from a run's squares."""
    model = Beating([noisy(np.full_like(TIME, 2.0), seed) for seed in range(8)])
    found = explained(model)
    assert found.final.effects == ()


def test_looks_make_the_cost_the_probability_of_the_data() -> None:
    """Linear and Gaussian, y = p t + noise, p ~ N(0, s^2): y ~ N(0, 1 + s^2 t t')."""

    class Slope(Line):
        states = (Unknown(name="p", start=0.0, lower=-50, upper=50, logarithmic=False, std=0.4),)
        parameters = ()

        def residual(self, run: int, effects: Sequence[str]) -> Callable[..., Array]:
            return lambda v: (self.measured[run] - v["p"] * TIME)[None, :]

    model = Slope([noisy(0.3 * TIME)], ())
    found = fit(model, (), [0], {}, [{"p": 0.0}])
    covariance = np.eye(len(TIME)) + 0.4**2 * np.outer(TIME, TIME)
    y = model.measured[0]
    expected = y @ np.linalg.solve(covariance, y) + np.linalg.slogdet(covariance).logabsdet
    assert found.occam_penalty == pytest.approx(np.log1p(0.4**2 * np.sum(TIME**2)), abs=0.2)
    assert found.cost == pytest.approx(expected, abs=0.2)


def test_a_size_is_charged_as_if_it_were_drawn() -> None:
    """By hand, without parameters: y = s x^3 + noise, s ~ N(0, 2^2), of which the cost lacks only
    the improbability of the size itself, (s / 2)^2.
    """

    class Cube(Line):
        parameters = ()

        def residual(self, run: int, effects: Sequence[str]) -> Callable[..., Array]:
            return lambda v: (self.measured[run] - v["cube_size"] * TIME**3)[None, :]

    model = Cube([noisy(0.3 * TIME**3)], ("cube",))
    found = fit(model, ("cube",), [0], {"cube_size": 1.0}, [{}])
    column = 2.0 * TIME**3
    covariance = np.eye(len(TIME)) + np.outer(column, column)
    y = model.measured[0]
    expected = y @ np.linalg.solve(covariance, y) + np.linalg.slogdet(covariance).logabsdet
    size = found.values["cube_size"]
    assert found.cost + (size / 2.0) ** 2 == pytest.approx(expected, abs=0.3)


def test_a_size_that_the_data_do_not_show_costs_nothing() -> None:
    """Neither does it pay for the sizes that the data show."""

    class Idle(Line):
        def residual(self, run: int, effects: Sequence[str]) -> Callable[..., Array]:
            return super().residual(run, [name for name in effects if name != "wave"])

    model = Idle([noisy(2.0 + 3.0 * TIME + 0.3 * TIME**3)], ("cube", "wave"))
    alone = fit(model, ("cube",), [0], {}, [{}])
    both = fit(model, ("cube", "wave"), [0], {}, [{}])
    assert alone.occam_penalty > 3.0
    assert both.occam_penalty == pytest.approx(alone.occam_penalty, abs=0.01)


def test_a_size_far_below_the_plausible_one_is_not_named() -> None:
    """By hand: 0.017 of the plausible size at 5.5 standard errors gains 15 nats, and e^-6.5 of the
    sizes that were as probable lie there.
    """
    column = TIME**3 - 0.6 * TIME
    left = column - np.polynomial.polynomial.polyval(
        TIME, np.polynomial.polynomial.polyfit(TIME, column, 1)
    )
    scale = 5.5 / 0.017 / float(np.linalg.norm(left))
    noise = noisy(0.0 * TIME)
    noise -= left * (left @ noise) / (left @ left)

    class Steep(Line):
        def residual(self, run: int, effects: Sequence[str]) -> Callable[..., Array]:
            def residual(v: Mapping[str, float]) -> Array:
                y = v["a"] + v["b"] * TIME
                if effects:
                    y = y + v["cube_size"] * scale * column
                return (self.measured[run] - y)[None, :]

            return residual

    assert explained(Steep([noise + 0.017 * scale * left], ("cube",))).final.effects == ()
    assert explained(Steep([noise + 0.05 * scale * left], ("cube",))).final.effects == ("cube",)


def test_held_out_run_starts_in_the_valley_of_its_own_beat() -> None:
    y = noisy(wave(0.5, 3.37, 2.0))
    found = scan_unknowns(
        lambda v: (y - wave(0.5, v["beat_rate"], v["beat_phase"]))[None, :],
        {"beat_rate": 0.0, "beat_phase": 0.0},
        BEAT.states,
    )
    folded = np.sign(found["beat_rate"]) * np.array([found["beat_rate"], found["beat_phase"]])
    np.testing.assert_allclose(folded, [3.37, 2.0], atol=0.3)


def test_states_that_a_fit_of_all_runs_found_are_not_looked_for_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = Beating([noisy(wave(2.0, rate, phase), k) for k, (rate, phase) in enumerate(RUNS)])
    near = [{"beat_rate": rate + 0.01, "beat_phase": phase} for rate, phase in RUNS]
    values = {"a": 0.0, "b": 0.0, "beat_size": 2.0}
    start = fit(model, ("beat",), (0, 1), values, near[:2])
    monkeypatch.delattr(Line, "initial_states")
    found = predict(model, Fold(fitted=(0, 1), predicted=(2,), start=start, states=(near[2],)))
    assert np.std(found.residuals[0]) == pytest.approx(1.0, abs=0.05)


def test_prediction_has_no_more_of_an_effect_than_the_fitted_runs_show() -> None:
    """By hand: n x^6 / 7 tell the cube of 3 where it shows, and x^3 follows no line by 4/25 of it;
    where it does not show it is absent, though the fit of all runs had it.
    """
    model = Line([noisy(2.0 + 3.0 * TIME**3)], ["cube", "kink"])
    start = fit(model, ("cube",), [0], {"a": 0.0, "b": 0.0, "cube_size": 1.0}, [{}])
    shown = refit_fold(model, Fold(fitted=(0,), predicted=(), start=start))
    assert shown.values["cube_size"] == pytest.approx(start.values["cube_size"], rel=0.02)
    model.residual = lambda run, effects: Line.residual(model, run, ())  # type: ignore[method-assign]
    hidden = refit_fold(model, Fold(fitted=(0,), predicted=(), start=start))
    assert hidden.values["cube_size"] == pytest.approx(0.0, abs=1e-3)
