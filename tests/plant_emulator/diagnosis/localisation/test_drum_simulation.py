"""The drum driven by a known gear speed, against hand calculations and scipy's integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plant_emulator.diagnosis.localisation.drum_simulation import compile_once, drum_speed

# Thesis, Table 3.1: half gap, damping, drum's inertia; stiffness by eq. 3.32 and 3.33.
ALPHA, K, C, J = 0.15073, 1349265.04, 120320.0, 312.69
TIME = np.arange(0.0, 4.0, 0.01)


def driven(
    gear: np.ndarray, torque: float = 0.0, *, parked: float = 0.0, position: float = 0.0
) -> np.ndarray:
    constant = np.ones_like(TIME)
    return compile_once(drum_speed)(
        TIME, gear, torque * constant, parked * constant, position, ALPHA, K, C, J
    )


def test_a_drum_in_the_gap_feels_its_own_torque_only() -> None:
    found = driven(np.zeros_like(TIME), torque=3.0)
    # It turns by 3/(2 J) t^2: half a gap after 5.6 s.
    assert found == pytest.approx(3.0 / J * TIME, rel=1e-12)


def test_a_drum_is_taken_along_when_the_gear_has_crossed_the_gap() -> None:
    found = driven(np.full_like(TIME, 0.1), position=-1.0)
    # 2 alpha / 0.1 rad/s = 3.01 s; the damper touches c/k = 0.09 s earlier.
    first = TIME[np.flatnonzero(found > 1e-6)[0]]
    assert first == pytest.approx(2.0 * ALPHA / 0.1 - C / K, abs=0.02)
    assert found[-1] == pytest.approx(0.1, rel=1e-4)


def test_a_steadily_accelerated_drum_follows_at_the_gear_s_speed() -> None:
    found = driven(2.0 * TIME, position=1.0)
    assert found[-1] == pytest.approx(2.0 * TIME[-1], abs=1e-6)


def test_a_parked_drum_stands_whatever_pushes_it() -> None:
    assert not driven(np.sin(TIME), torque=100.0, parked=1.0).any()


def test_impacts_and_rebounds_agree_with_an_integrator_of_high_order() -> None:
    gear = 3.0 * np.sin(2.0 * TIME) + 0.5 * np.sin(9.0 * TIME)

    def rate(t: float, state: np.ndarray) -> list[float]:
        slip = np.interp(t, TIME, gear) - state[1]
        y = state[0] + C / K * slip
        return [slip, (K * (max(y - ALPHA, 0.0) + min(y + ALPHA, 0.0)) + 20.0) / J]

    fine = solve_ivp(
        rate,
        (0.0, TIME[-1]),
        [0.3 * ALPHA, 0.0],
        "RK45",
        TIME,
        rtol=1e-9,
        atol=1e-10,
        max_step=1e-3,
    )
    # The sensor's noise is 0.004 rad/s.
    assert driven(gear, torque=20.0, position=0.3) == pytest.approx(fine.y[1], abs=2e-4)
