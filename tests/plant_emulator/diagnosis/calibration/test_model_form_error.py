"""The error that other laws make in a size, by hand and by tables of Student's t."""

import pytest

from plant_emulator.diagnosis.calibration.model_form_error import EstimatedSize, model_form_errors


def sized(true: float, estimated: float, standard_error: float, name: str = "lag") -> EstimatedSize:
    return EstimatedSize(
        name=name, true=true, estimated=estimated, standard_error=standard_error, plausible=1.0
    )


def test_small_estimate_is_off_by_a_part_of_the_plausible_size() -> None:
    """By hand: 0.9 of the usual 1, though 9 times the estimate."""
    assert model_form_errors([sized(1.0, 0.1, 0.0)])["lag"] == pytest.approx(
        0.9 * 12.706 / 1.960, rel=1e-4
    )


def test_one_case_is_widened_by_students_t_of_one_degree_of_freedom() -> None:
    # off by 2 of 10, and t(0.975; 1) = 12.706 over the normal 1.960
    assert model_form_errors([sized(12.0, 10.0, 0.0)])["lag"] == pytest.approx(
        0.2 * 12.706 / 1.960, rel=1e-4
    )


def test_deviation_within_the_noise_counts_as_none() -> None:
    # t(0.975; 2) = 4.3027; one of two off by 0.2
    cases = [sized(12.0, 10.0, 0.0), sized(10.5, 10.0, 1.0)]
    assert model_form_errors(cases)["lag"] == pytest.approx(0.2 / 2**0.5 * 4.3027 / 1.960, rel=1e-4)


def test_deviation_is_relative_to_the_estimate_of_either_sign() -> None:
    few = model_form_errors([sized(-12.0, -10.0, 0.0), sized(1.2, 1.0, 0.0, "gain")])
    assert few["lag"] == pytest.approx(few["gain"])


def test_noise_is_taken_from_the_deviation() -> None:
    # 5^2 - 4^2 = 3^2
    assert model_form_errors([sized(15.0, 10.0, 4.0)])["lag"] == pytest.approx(
        0.3 * 12.706 / 1.960, rel=1e-4
    )
