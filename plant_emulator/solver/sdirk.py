"""One step of SDIRK3: its three stages, its local error, and the states within the step.

Three-stage, singly diagonally implicit Runge-Kutta method of order 3, L-stable and stiffly accurate
(Alexander, SIAM J. Numer. Anal. 14 (1977) 1006):

    X1 = x + gamma h f(X1)
    X2 = x + (c - gamma) h f(X1) + gamma h f(X2)
    X3 = x + b1 h f(X1) + b2 h f(X2) + gamma h f(X3),   x(t + h) = X3

gamma = 0.4359 is the root of g^3 - 3 g^2 + 3/2 g - 1/6, and c = (1 + gamma) / 2.
Each stage is X = base + a f(X) with a = gamma h. Since h f(X) = (X - base) / gamma, what the next
stage starts from needs no f, and f itself is never evaluated.

Error estimate: the sum of the slopes at t and of the three stages that is the method's own error
where the bench is linear and its inputs are straight: -0.0259 h^4 times the fourth derivative.
Where a contact closes or a limit is reached, the slopes jump and the step shrinks.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.model.implicit_stage import load, solve_stage, store

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State

GAMMA = 0.43586652150845899942
MIDDLE = 0.5 * (1.0 + GAMMA)
# Weights of the slopes: of the first stage in the second, and of both in the third.
MIDDLE_1 = MIDDLE - GAMMA
LAST_1 = -(6.0 * GAMMA**2 - 16.0 * GAMMA + 1.0) / 4.0
LAST_2 = (6.0 * GAMMA**2 - 20.0 * GAMMA + 5.0) / 4.0


def _error_weights() -> tuple[float, ...]:
    """Weights of the slopes at 0, gamma, c and 1 in the error estimate.

    For x' = lambda x the estimate has no power of lambda h below the fourth, and of the fourth as
    much as the error of the method.
    """
    stages = np.array(
        [
            [0.0, 0.0, 0.0, 0.0],
            [0.0, GAMMA, 0.0, 0.0],
            [0.0, MIDDLE_1, GAMMA, 0.0],
            [0.0, LAST_1, LAST_2, GAMMA],
        ]
    )
    powers = [np.ones(4)]
    for _ in range(3):
        powers.append(stages @ powers[-1])
    own = float(stages[-1] @ powers[3]) - 1.0 / 24.0
    return tuple(map(float, np.linalg.solve(np.array(powers), [0.0, 0.0, 0.0, own])))


ERROR_0, ERROR_1, ERROR_2, ERROR_3 = _error_weights()

# States whose error is controlled, and one over what a tolerance of 1 allows of each. The speed's
# integrator counts by its range: it stands still while the current is limited, and an error there
# adds up. A limit that ends 2 ms late makes the drum leave its flank 3e-4 rad/s too fast, and after
# a flight of 9 s the gap closes 4 ms late. The current is fast: its error dies out in some steps,
# so that four times its range in a run at full speed is allowed; more would show in a logged
# voltage. The error of the motor's speed may be its range, that of the drum's speed half of it.
# Impacts show in the twist, of whose range an eighth is allowed.
CONTROLLED = (0, 2, 3, 4, 7)
WEIGHT = (1.0 / 2.0, 1.0 / 280.0, 1.0 / 400.0, 1.0 / 0.15e-3, 1.0 / 3.0)

SHRINK, GROW, SAFETY = 0.2, 5.0, 0.9
SMALLEST_STEP = 1e-6
# Error that is assigned to a step with an unsolved stage, in tolerances [1].
UNSETTLED = 1e6
# Below this error, in tolerances, the next step grows by GROW; above, by the fourth root.
EASY = (SAFETY / GROW) ** 4

# Rows of the work space: first and second stage, what the last stage starts from, the last stage,
# and the slope at the begin of the step.
FIRST, SECOND, BASE, LAST, SLOPE = 0, 1, 2, 3, 4


def step(
    h: float,
    t: float,
    r: tuple[float, float, float],
    x: State,
    w: State,
    s: Record,
    p: Record,
) -> None:
    """Take one step from the state x at time t. The result goes to w[LAST]; x is not changed.

    h : length of the step [s]; r : delayed reference at the three stages [rad/s]
    w : work space, five state vectors
    """
    first, second, base, last, slope = w[FIRST], w[SECOND], w[BASE], w[LAST], w[SLOPE]
    # Each stage starts from all states extrapolated. A law that follows an angle, a memory or the
    # current would otherwise cost another pass at every stage.
    for k in range(len(x)):
        first[k] = x[k] + GAMMA * h * slope[k]
    load(first, s)
    s.time, s.delayed_reference = t + GAMMA * h, r[0]
    solve_stage(x, GAMMA * h, s, p)
    store(s, first)
    for k in range(len(x)):
        rise = (first[k] - x[k]) / GAMMA
        base[k] = x[k] + MIDDLE_1 * rise
        second[k] = x[k] + MIDDLE * rise
    load(second, s)
    s.time, s.delayed_reference = t + MIDDLE * h, r[1]
    solve_stage(base, GAMMA * h, s, p)
    store(s, second)
    for k in range(len(x)):
        rise_1, rise_2 = (first[k] - x[k]) / GAMMA, (second[k] - base[k]) / GAMMA
        base[k] = x[k] + LAST_1 * rise_1 + LAST_2 * rise_2
        # The slope between both stages, extrapolated to the middle of the rest of the step.
        last[k] = second[k] + (1.0 - MIDDLE) * (1.5 * rise_2 - 0.5 * rise_1)
    load(last, s)
    s.time, s.delayed_reference = t + h, r[2]
    solve_stage(base, GAMMA * h, s, p)
    store(s, last)


def local_error(h: float, x: State, w: State) -> float:
    """Largest local error of the controlled states, each times its WEIGHT [1]; inf for a NaN."""
    first, second, base, last, slope = w[FIRST], w[SECOND], w[BASE], w[LAST], w[SLOPE]
    error = 0.0
    for j in range(len(CONTROLLED)):
        k = CONTROLLED[j]
        rise_1 = (first[k] - x[k]) / GAMMA
        rise_2 = (second[k] - x[k] - MIDDLE_1 * rise_1) / GAMMA
        rise_3 = (last[k] - base[k]) / GAMMA
        total = ERROR_0 * h * slope[k] + ERROR_1 * rise_1 + ERROR_2 * rise_2 + ERROR_3 * rise_3
        size = abs(total) * WEIGHT[j]
        if not size <= error:
            error = size if size > error else inf
    return error


def growth(error: float) -> float:
    """Factor from a step with that error, in tolerances, to the next step [1]."""
    if error <= EASY:
        return GROW
    factor: float = SAFETY * error**-0.25
    return max(SHRINK, factor)


def accept(h: float, x: State, w: State) -> None:
    """Copy the result of the step to the state x, and keep the slope at its end."""
    base, last, slope = w[BASE], w[LAST], w[SLOPE]
    per_stage = 1.0 / (GAMMA * h)
    for k in range(len(x)):
        slope[k] = (last[k] - base[k]) * per_stage
        x[k] = last[k]


def interpolate(since: float, h: float, x: State, w: State) -> State:
    """State at the time `since` after the start of a step [s], by cubic Hermite interpolation.

    The result overwrites the first stage in w, which is not needed any more.
    """
    first, base, last, slope = w[FIRST], w[BASE], w[LAST], w[SLOPE]
    u = since / h
    rise, start, end = u * u * (3.0 - 2.0 * u), since * (1.0 - u) ** 2, since * u * (u - 1.0)
    per_stage = 1.0 / (GAMMA * h)
    for k in range(len(x)):
        slope_1 = (last[k] - base[k]) * per_stage
        first[k] = x[k] + rise * (last[k] - x[k]) + start * slope[k] + end * slope_1
    return first
