"""What an effect gains beside other forms of another effect's law, against hand calculations."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import inf

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.confirmation import Reduction
from plant_emulator.diagnosis.search.law_forms import errors_beside_forms, gain_beside_forms
from plant_emulator.diagnosis.search.search import Search
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Line, explained, noisy, runner

# The cube's law may grow otherwise: x^3 (1 + c sqrt(3) x). That of the kink: |x| (1 + c |x|).
FORM, KINK_FORM = "cube_size by x", "kink_size by x"
BENT = np.sqrt(3.0) * TIME**4


class Bent(Line):
    """A line whose cube may follow another law, and its kink where it has a form."""

    def __init__(self, measured: Sequence[Array], names: Sequence[str]) -> None:
        super().__init__(measured, names)
        self.candidates["cube"] = replace(self.candidates["cube"], forms=(FORM,))

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, effects)

        def residual(v: Mapping[str, float]) -> Array:
            bent = v.get(FORM, 0.0) * v.get("cube_size", 0.0) * BENT
            kink = v.get(KINK_FORM, 0.0) * v.get("kink_size", 0.0) * TIME**2
            return np.asarray(plain(v) - bent - kink)

        return residual


def gain(measured: Array, names: tuple[str, ...], effect: str) -> float:
    """Gain of an effect of a set in one run."""
    model = Bent([measured], names)
    found = fit(model, names, (0,), {"a": 0.0, "b": 0.0}, [{}])
    return gain_beside_forms(model, Reduction(found, (0,), effect))


def test_gain_by_hand() -> None:
    """By hand: the kink of size 2 has the variance of least squares in the columns 1, x, x^3, |x|
    and 30 sqrt(3) x^4, the last one with the prior 0 +- 0.1.
    """
    measured = 30.0 * TIME**3 + 2.0 * np.abs(TIME) + np.random.default_rng(1).normal(size=2000)
    columns = np.stack([TIME**0, TIME, TIME**3, np.abs(TIME), 30.0 * BENT], axis=-1)
    prior = np.diag([0.01, 0.01, 0.0, 0.0, 100.0])
    covariance = np.linalg.inv(columns.T @ columns + prior)
    size = (covariance @ columns.T @ measured)[3]
    expected = 0.5 * size**2 / covariance[3, 3]
    assert gain(measured, ("cube", "kink"), "kink") == pytest.approx(expected, rel=0.05)


def test_nothing_is_asked_where_no_other_law_has_a_form() -> None:
    measured = noisy(30.0 * TIME**3 + 2.0 * np.abs(TIME))
    assert gain(measured, ("cube", "kink"), "cube") == inf


@pytest.mark.parametrize("error", [0.0, 0.018])
def test_errors_by_hand(error: float) -> None:
    """By hand, with cube and kink whose laws may both grow otherwise: the error of each size beside
    the form of the other law, and that of the level beside both, are those of least squares with
    these columns too, and of the change that they make.
    """
    law = 30.0 * (TIME**3 + error * BENT)
    measured = law + 4.0 * np.abs(TIME) + np.random.default_rng(1).normal(size=2000)
    model = Bent([measured], ("cube", "kink"))
    kink = model.candidates["kink"]
    sizes = (replace(kink.sizes[0], scale=2.0),)
    model.candidates["kink"] = replace(kink, sizes=sizes, forms=(KINK_FORM,))
    found = fit(model, ("cube", "kink"), (0,), {"a": 0.0, "b": 0.0}, [{}])
    values = found.values
    columns = {
        "a": TIME**0,
        "b": TIME,
        "cube_size": TIME**3,
        "kink_size": np.abs(TIME),
        FORM: values["cube_size"] * BENT,
        KINK_FORM: values["kink_size"] * TIME**2,
    }
    prior = {"a": 0.01, "b": 0.01, FORM: 100.0, KINK_FORM: 100.0}

    def expected(name: str, left_out: str) -> float:
        names = [n for n in columns if n != left_out]
        matrix = np.stack([columns[n] for n in names], axis=-1)
        precision = np.diag([prior.get(n, 0.0) for n in names])
        covariance = np.linalg.inv(matrix.T @ matrix + precision)
        k = names.index(name)
        return float(
            np.hypot(
                np.sqrt(covariance[k, k]), (covariance @ matrix.T @ measured)[k] - values[name]
            )
        )

    errors = errors_beside_forms(model, Task(base=found, runs=(0,)))
    assert errors["kink_size"] == pytest.approx(expected("kink_size", KINK_FORM), rel=0.03)
    assert errors["cube_size"] == pytest.approx(expected("cube_size", FORM), rel=0.03)
    assert errors["a"] == pytest.approx(expected("a", ""), rel=0.03)
    far = abs(values["kink_size"] - 4.0)
    assert (far > 2.0 * found.standard_errors["kink_size"]) == (error > 0.0)
    assert far < 2.0 * errors["kink_size"]


@pytest.mark.parametrize(("level", "bound"), [(3.0, {"upper": 0.0}), (-3.0, {"lower": 0.0})])
def test_value_at_its_bound_follows_no_form(level: float, bound: dict[str, float]) -> None:
    """By hand: the level is stopped at 0, and would be 3. Least squares have no column for it."""
    measured = level + 30.0 * TIME**3 + 4.0 * np.abs(TIME)
    model = Bent([measured + np.random.default_rng(1).normal(size=2000)], ("cube", "kink"))
    stopped, slope = Line.parameters
    model.parameters = (replace(stopped, **bound), slope)  # type: ignore[arg-type]
    found = fit(model, ("cube", "kink"), (0,), {"a": 0.0, "b": 0.0}, [{}])
    columns = [TIME, TIME**3, np.abs(TIME), found.values["cube_size"] * BENT]
    matrix = np.stack(columns, axis=-1)
    covariance = np.linalg.inv(matrix.T @ matrix + np.diag([0.01, 0.0, 0.0, 100.0]))
    size = (covariance @ matrix.T @ model.measured[0])[2]
    rise = (
        covariance[2, 2] - np.linalg.inv(matrix.T @ matrix + np.diag([0.01, 0.0, 0.0, 1e12]))[2, 2]
    )
    expected = np.sqrt(rise + (size - found.values["kink_size"]) ** 2)
    more = errors_beside_forms(model, Task(base=found, runs=(0,)))["kink_size"]
    own = found.standard_errors["kink_size"]
    assert np.sqrt(more**2 - own**2) == pytest.approx(expected, rel=0.05)


def test_error_beside_a_form_that_changes_nothing_is_that_of_the_fit() -> None:
    """The wave is orthogonal to all else; its noise is correlated, which its error contains."""
    noise = np.convolve(np.random.default_rng(2).normal(size=2040), np.ones(41), mode="valid")
    measured = 30.0 * TIME**3 + 5.0 * np.sin(20.0 * TIME) + noise / np.sqrt(41.0)
    model = Bent([measured], ("cube", "wave"))
    found = fit(model, ("cube", "wave"), (0,), {"a": 0.0, "b": 0.0}, [{}])
    errors = errors_beside_forms(model, Task(base=found, runs=(0,)))
    assert errors["wave_size"] >= found.standard_errors["wave_size"]
    assert errors["wave_size"] == pytest.approx(found.standard_errors["wave_size"], rel=0.05)


def test_fit_that_ended_early_has_the_same_errors() -> None:
    """The level is ten of its errors off its least squares, and the cube's form is like a level."""
    measured = noisy(30.0 * (TIME**3 + 0.018 * BENT) + 4.0 * np.abs(TIME))
    model = Bent([measured], ("cube", "kink"))
    found = fit(model, ("cube", "kink"), (0,), {"a": 0.0, "b": 0.0}, [{}])
    off = found.values["a"] + 10.0 * found.standard_errors["a"]
    early = replace(found, values={**found.values, "a": off})
    ended, begun = (errors_beside_forms(model, Task(base=f, runs=(0,))) for f in (found, early))
    assert begun["kink_size"] == pytest.approx(ended["kink_size"], rel=0.05)


def test_error_of_an_answer_contains_the_error_of_the_other_law() -> None:
    """The kink of 4 beside a cube whose law is off by 0.018 is off by more than its fit tells."""
    law = 30.0 * (TIME**3 + 0.018 * BENT)
    measured = [noisy(law + 4.0 * np.abs(TIME), k) for k in range(2)]
    final = explained(Bent(measured, ["cube", "kink"])).final
    assert set(final.effects) == {"cube", "kink"}
    assert abs(final.values["kink_size"] - 4.0) < 2.0 * final.standard_errors["kink_size"]
    alone = explained(Line(measured, ["cube", "kink"])).final
    assert abs(alone.values["kink_size"] - 4.0) > 2.0 * alone.standard_errors["kink_size"]


@pytest.mark.parametrize(
    ("error", "hidden", "named"),
    [(0.018, 0.0, ("cube",)), (0.0, 2.0, ("cube", "kink"))],
)
def test_second_effect_that_only_follows_the_error_of_a_law_is_not_named(
    error: float, hidden: float, named: tuple[str, ...]
) -> None:
    """The cube grows otherwise by two percent; a kink follows that, and gains more than 40."""
    law = 30.0 * (TIME**3 + error * BENT)
    measured = [noisy(law + hidden * SHAPES["kink"](TIME), k) for k in range(2)]
    found = explained(Bent(measured, ["cube", "kink"]))
    assert found.final.effects == named
    both = [s for s in found.trace if set(s.effects) == {"cube", "kink"}]
    alone = max(s.gain for s in found.trace if s.effects == ("cube",))
    assert max(s.gain for s in both) - alone > 40.0
    refuted = any(s.action.startswith("refuted by other forms") for s in both)
    assert refuted == (named == ("cube",))


def test_size_that_would_change_its_side_gains_nothing() -> None:
    """The law is off by 0.08, and the kink of size -2.5 may only have sizes above 0."""
    measured = noisy(30.0 * (TIME**3 + 0.08 * BENT) - 2.5 * np.abs(TIME))
    model = Bent([measured], ("cube", "kink"))
    kink = model.candidates["kink"]
    model.candidates["kink"] = replace(kink, sizes=(replace(kink.sizes[0], lower=0.0),))
    found = fit(model, ("cube", "kink"), (0,), {"a": 0.0, "b": 0.0}, [{}])
    assert found.values["kink_size"] > 0.5
    assert gain_beside_forms(model, Reduction(found, (0,), "kink")) == 0.0


def test_first_effect_that_lives_on_the_error_of_the_law_of_the_second_falls() -> None:
    """The kink has been found first; the cube, whose law is off by 0.018, closes nearly all."""
    measured = [noisy(30.0 * (TIME**3 + 0.018 * BENT), k) for k in range(2)]
    there = runner(Bent(measured, ["cube", "kink"]))
    search = Search(declared=there, runner=there, null=fit_null(there.model, there.runs))
    search.sets[frozenset()] = search.null
    start = {"a": 0.0, "b": 0.0}
    for names in (("kink", "cube"), ("cube",)):
        search.keep(fit(there.model, names, there.runs, start, [{}, {}]))
    both = search.sets[frozenset(("cube", "kink"))]
    assert search.value(search.sets[frozenset(("cube",))]) - search.value(both) > 0.0
    assert search._without_needless(both).effects == ("cube",)
    assert any(step.action.startswith("refuted by other forms") for step in search.trace)


@pytest.mark.parametrize(("size", "named"), [(0.7, {"cube"}), (1.2, {"cube", "wave"})])
def test_second_effect_that_leaves_most_of_what_the_law_leaves_falls(
    size: float, named: set[str]
) -> None:
    """By hand: the cube explains 2000 45^2 4 / 175 = 92 600 squares.

    Its law leaves 2000 0.95^2 / 2 = 900 as a cosine, below a hundredth of that. A wave of
    0.7 explains 490 beside it, and one of 1.2 1440.
    """
    law = 45.0 * TIME**3 + 0.95 * np.cos(900.0 * TIME)
    measured = [noisy(law + size * np.sin(20.0 * TIME))]
    there = runner(Bent(measured, ["cube", "wave"]))
    search = Search(declared=there, runner=there, null=fit_null(there.model, there.runs))
    search.sets[frozenset()] = search.null
    start = {"a": 0.0, "b": 0.0}
    for names in (("cube",), ("cube", "wave")):
        search.keep(fit(there.model, names, there.runs, start, [{}]))
    found = search._without_needless(search.sets[frozenset(("cube", "wave"))])
    assert set(found.effects) == named
