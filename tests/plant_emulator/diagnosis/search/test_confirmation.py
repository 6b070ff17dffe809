"""Fits of a hypothesis from its starts, and the order in which hypotheses are fitted."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.execution.pool import TaskRunner
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.machine import Candidate, Model
from plant_emulator.diagnosis.screening.promise import Promise, Start
from plant_emulator.diagnosis.screening.screening import promises
from plant_emulator.diagnosis.search import confirmation, search
from plant_emulator.diagnosis.search.confirmation import (
    Reduction,
    Trial,
    confirm,
    fit_from_best_start,
    lead_trial,
    reduce,
    without_effects,
)
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import (
    TIME,
    Line,
    effect,
    explained,
    linear,
    noisy,
    runner,
)

WAVE = noisy(2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME))


def tone(frequency: Unknown, *, narrow: str) -> Candidate:
    """A wave of unknown amplitude; its frequency, in basins of 3, is a size or a state."""
    amplitude = replace(linear("amplitude", 1.0), lower=0.1)
    return replace(
        effect("tone"),
        sizes=(amplitude, frequency) if narrow == "size" else (amplitude,),
        states=() if narrow == "size" else (frequency,),
        neutral={"amplitude": 0.0, "frequency": 0.0} if narrow == "size" else {"amplitude": 0.0},
    )


class Tone(Line):
    """A line with a tone."""

    def __init__(self, measured: Array, candidate: Candidate) -> None:
        super().__init__([measured])
        self.candidates = {"tone": candidate}

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            y = v["a"] + v["b"] * TIME + v["amplitude"] * np.sin(v["frequency"] * TIME)
            return (self.measured[run] - y)[None, :]

        return residual


@pytest.mark.parametrize(("narrow", "side"), [("size", 1.0), ("size", -1.0), ("state", 1.0)])
def test_frequency_far_from_its_start_is_found_by_a_scan(narrow: str, side: float) -> None:
    """A descent from 20 ends at a side lobe, an amplitude of 0.6 in place of 4."""
    lower, upper = sorted((side, 50.0 * side))
    frequency = replace(linear("frequency", 20.0 * side), lower=lower, upper=upper, step=1.0)
    measured = noisy(2.0 + 3.0 * TIME + 4.0 * np.sin(side * 37.3 * TIME))
    model = Tone(measured, tone(frequency, narrow=narrow))
    values = {"a": 2.0, "b": 3.0, "amplitude": 4.0}
    given, state = {"frequency": frequency.start}, {}
    if narrow == "state":
        given, state = state, given
    start = Start(values={**values, **given}, states=(state,))
    trial = Trial(("tone",), (0,), (start,), (start,))
    descended = fit_from_best_start(model, trial)
    found = confirm(model, trial)
    assert abs(descended.values["amplitude"]) < 1.0
    assert found.values["amplitude"] == pytest.approx(4.0, abs=0.15)
    at = found.values if narrow == "size" else found.states[0]
    assert at["frequency"] == pytest.approx(side * 37.3, abs=0.1)


class TurnedTone(Line):
    """A line with a tone of one amplitude and an angle of each run."""

    def __init__(self, measured: Sequence[Array]) -> None:
        super().__init__(measured)
        amplitude = replace(linear("amplitude", 1.0), lower=0.1)
        angle = replace(linear("angle", 0.0), lower=-1.0, upper=6.0, angle=True)
        self.candidates = {
            "tone": replace(
                effect("tone"),
                sizes=(amplitude,),
                states=(replace(angle, std=np.pi / 3.0**0.5),),
                neutral={"amplitude": 0.0},
            )
        }

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            y = v["a"] + v["b"] * TIME + v["amplitude"] * np.sin(20.0 * TIME + v["angle"])
            return (self.measured[run] - y)[None, :]

        return residual


def test_led_start_far_from_the_noise_is_let_go_and_not_led_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The line also has a cosine of 2, so that no start comes near the noise."""
    y = 2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME) + 2.0 * np.cos(37.0 * TIME)
    model = Line([noisy(y)])
    start = Start(values={"a": 9.0, "b": -9.0, "wave_size": 0.0}, states=({},))
    trial, led = lead_trial(model, Trial(("wave",), (0,), (start,), (start,)))
    assert led.values["wave_size"] == pytest.approx(4.0, abs=0.15)
    monkeypatch.setattr(confirmation, "lead", None)
    found = confirm(model, trial)
    assert found.values["wave_size"] == pytest.approx(4.0, abs=0.15)


class Caught(Line):
    """y = a + wave_size sin(b x): a fit ends at the frequency that it begins near."""

    parameters = (linear("a", 0.0, std=10.0), linear("b", 20.0, prior=20.0, std=10.0))

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            return (self.measured[run] - v["a"] - v["wave_size"] * np.sin(v["b"] * TIME))[None, :]

        return residual


def test_start_that_leaves_more_at_first_leads_to_less() -> None:
    """By hand: a sine of 4 leaves 8. At half of its frequency it is not found.

    A wave of -4 at the right frequency leaves 32 before its fit, and nothing after it.
    """
    model = Caught([noisy(4.0 * np.sin(20.0 * TIME))], ["wave"])
    wrong, right = (
        Start(values={"a": 0.0, "b": at, "wave_size": size}, states=({},))
        for at, size in ((10.0, 0.1), (20.0, -4.0))
    )
    left = []
    for starts in ((wrong,), (right,), (wrong, right)):
        _, led = lead_trial(model, Trial(("wave",), (0,), starts, starts))
        left.append(led.mean_square)
    assert left == pytest.approx([9.0, 1.0, 1.0], rel=0.1)


def test_set_begins_as_it_is_where_its_led_fit_is_let_go_to_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The cosine of 0.6 stays, so that no start is near the noise."""
    y = 2.0 + 4.0 * np.sin(20.0 * TIME) + 0.6 * np.cos(37.0 * TIME)
    model = Line([noisy(y)], ["wave", "kink"])
    values = {"a": 2.0, "b": 0.0, "wave_size": 4.0, "kink_size": 0.1}
    start = Start(values=values, states=({},))
    known = fit(model, ("wave", "kink"), (0,), values, [{}])
    led, free = (replace(known, values={**values, "a": a}) for a in (20.0, 50.0))
    monkeypatch.setattr(confirmation, "let_go", lambda *_: free)
    begun = []
    monkeypatch.setattr(confirmation, "fit", lambda *args, **_: begun.append(args[3]))
    fit_from_best_start(model, Trial(("wave", "kink"), (0,), (start,), (start,), led=led))
    assert begun == [values]


def test_fit_begins_at_a_led_start_that_is_near_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    model = Line([noisy(2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME))])
    start = Start(values={"a": 9.0, "b": -9.0, "wave_size": 0.0}, states=({},))
    trial, led = lead_trial(model, Trial(("wave",), (0,), (start,), (start,)))
    begun = []
    monkeypatch.setattr(confirmation, "fit", lambda *args, **_: begun.append(args[3]) or led)
    confirm(model, trial)
    assert begun == [led.values]


def test_states_of_the_effects_stay_at_the_nominal_parameters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The tone keeps its angle; a scan without its amplitude would tell any."""
    asked: list[FitResult] = []
    measured = noisy(2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME + 0.7) + np.cos(37.0 * TIME))
    model = TurnedTone([measured])
    monkeypatch.setattr(TurnedTone, "relations", lambda _, where, *__: asked.append(where))
    monkeypatch.setattr(TurnedTone, "initial_states", lambda *_: {"angle": -1.0})
    values = {"a": 2.0, "b": 3.0, "amplitude": 4.0}
    base = fit(model, ("tone",), (0,), values, [{"angle": 0.7}])
    promises(runner(model), base, base)
    nominal = asked[1]
    assert nominal.values["a"] == 0.0
    assert nominal.values["amplitude"] == pytest.approx(4.0, abs=0.15)
    assert nominal.states[0]["angle"] == pytest.approx(0.7, abs=0.05)


def test_angle_that_descends_to_its_bound_is_found_by_a_scan() -> None:
    """From -0.4 the nearest way to 2.9 leads down past -1; the other run pays for the tone."""
    angles = (0.3, 2.9)
    plain = 2.0 + 3.0 * TIME
    model = TurnedTone([noisy(plain + 4.0 * np.sin(20.0 * TIME + angle)) for angle in angles])
    start = Start(
        values={"a": 2.0, "b": 3.0, "amplitude": 4.0},
        states=({"angle": 0.3}, {"angle": -0.4}),
    )
    trial = Trial(("tone",), (0, 1), (start,), (start,))
    assert fit_from_best_start(model, trial).values["amplitude"] < 3.0
    found = confirm(model, trial)
    assert found.values["amplitude"] == pytest.approx(4.0, abs=0.15)
    turned = [own["angle"] - angle for own, angle in zip(found.states, angles, strict=True)]
    assert np.cos(turned) == pytest.approx(1.0, abs=0.01)


def test_set_without_an_effect_starts_where_the_slopes_tell_it_to_be(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On a line the slopes tell all: the start is the least squares of the other columns."""
    y = WAVE + 5.0 * np.abs(TIME)
    model = Line([y])
    both = fit(
        model, ("wave", "kink"), (0,), fit_null(model, (0,)).values | {"kink_size": 1.0}, [{}]
    )
    asked: list[Trial] = []

    def listen(model: Model, trial: Trial) -> FitResult:
        asked.append(trial)
        return fit_from_best_start(model, trial)

    monkeypatch.setattr(confirmation, "fit_from_best_start", listen)
    found = reduce(model, Reduction(both, (0,), "kink"))
    columns = np.column_stack([np.ones_like(TIME), TIME, np.sin(20.0 * TIME)])
    prior = np.diag([0.1, 0.1, 0.0])  # a and b have standard deviations of 10
    rows = np.concatenate([columns, prior])
    expected, *_ = np.linalg.lstsq(rows, np.concatenate([y, np.zeros(3)]), rcond=None)
    absent, as_it_is = asked[0].starts
    assert [absent.values[name] for name in ("a", "b", "wave_size")] == pytest.approx(expected)
    assert as_it_is.values["a"] == pytest.approx(2.0, abs=0.2)
    assert absent.values["kink_size"] == as_it_is.values["kink_size"] == 0.0
    assert found.effects == ("wave",)
    assert found.values["a"] == pytest.approx(expected[0])


class Simulating(Line):
    """A line that simulates every effect whose size is among the values, as the bench does."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            names = [name for name in self.candidates if f"{name}_size" in v]
            return super(Simulating, self).residual(run, names)(v)

        return residual


@pytest.mark.parametrize("size", [0.1, 4.0])
def test_fit_without_effects_starts_anew_only_where_that_leaves_less(size: float) -> None:
    """A wave of 4 is the cause, and its values leave 9 without it. One of 0.1 led there by luck."""
    model = Simulating([noisy(2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME))])
    null = fit_null(model, (0,))
    other = fit(model, ("wave",), (0,), {**null.values, "wave_size": size}, [{}])
    known = replace(null, values={"a": 3.0, "b": 3.0}, sum_of_squares=2.0 * null.samples)
    found = without_effects(model, (known, Reduction(other, (0,), "wave")))
    assert (found is known) == (size == 4.0)
    assert found.effects == ()
    assert size == 4.0 or found.cost == pytest.approx(null.cost)


def test_effect_that_gains_little_beside_one_that_leaves_noise_is_not_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The relations, as the first score, stand for a cube where a wave acts."""

    def with_relations(runner: TaskRunner, base: FitResult, led: FitResult | None) -> list[Promise]:
        found = promises(runner, base, led)
        wrong = {"cube": 900.0, "wave": 90.0}
        return [replace(p, gains={"relations": wrong.get(p.effect, 0.0), **p.gains}) for p in found]

    monkeypatch.setattr(search, "promises", with_relations)
    found = explained(Line([WAVE]))
    confirmed = [step.effects for step in found.trace if step.action == "confirmed"]
    assert confirmed[0] == ("wave",)
    assert ("cube",) not in confirmed
    assert found.final.effects == ("wave",)
