"""One step of SDIRK2: its two stages, its local error, and the states within the step.

Two-stage, singly diagonally implicit Runge-Kutta method of order 2, L-stable and stiffly accurate
(Alexander, SIAM J. Numer. Anal. 14 (1977) 1006):

    X1 = x + gamma h f(X1)
    X2 = x + (1 - gamma) h f(X1) + gamma h f(X2),   x(t + h) = X2,   gamma = 1 - 1/sqrt(2)

Each stage is X = base + a f(X) with a = gamma h. Since f(X1) = (X1 - x) / a, the second base is
x + (1 - gamma)/gamma (X1 - x), and f itself is never evaluated.

Error estimate: the slopes at t, t + gamma h and t + h give a quadrature of order 3. The local error
is its difference from the method's own quadrature. Where a contact closes or a limit is reached,
the slopes jump and the step shrinks.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import TYPE_CHECKING

from plant_emulator.model.implicit_stage import load, solve_stage, store

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State

GAMMA = 1.0 - 1.0 / sqrt(2.0)
# Weights of the error estimate: quadrature of order 3 at 0, gamma and 1, minus the method's own.
_W1 = 1.0 / (6.0 * GAMMA * (1.0 - GAMMA))
_W2 = 0.5 - _W1 * GAMMA
ERROR_0, ERROR_1, ERROR_2 = 1.0 - _W1 - _W2, _W1 - (1.0 - GAMMA), _W2 - GAMMA

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
# Below this error, in tolerances, the next step grows by GROW; above, by the cubic root.
EASY = (SAFETY / GROW) ** 3

# Rows of the work space.
FIRST, BASE, LAST, SLOPE = 0, 1, 2, 3


def step(
    h: float, t: float, r: tuple[float, float], x: State, w: State, s: Record, p: Record
) -> None:
    """Take one step from the state x at time t. The result goes to w[LAST]; x is not changed.

    h : length of the step [s]; r : delayed reference at t + gamma h and at t + h [rad/s]
    w : work space, four state vectors
    """
    first, base, last, slope = w[FIRST], w[BASE], w[LAST], w[SLOPE]
    # Each stage starts from all states extrapolated. A law that follows an angle, a memory or the
    # current would otherwise cost another pass at every stage.
    for k in range(len(x)):
        first[k] = x[k] + GAMMA * h * slope[k]
    load(first, s)
    s.time, s.delayed_reference = t + GAMMA * h, r[0]
    solve_stage(x, GAMMA * h, s, p)
    store(s, first)
    for k in range(len(x)):
        base[k] = x[k] + (1.0 - GAMMA) / GAMMA * (first[k] - x[k])
        last[k] = x[k] + (first[k] - x[k]) / GAMMA
    load(last, s)
    s.time, s.delayed_reference = t + h, r[1]
    solve_stage(base, GAMMA * h, s, p)
    store(s, last)


def local_error(h: float, x: State, w: State) -> float:
    """Largest local error of the controlled states, each times its WEIGHT [1]; inf for a NaN."""
    first, base, last, slope = w[FIRST], w[BASE], w[LAST], w[SLOPE]
    per_stage, error = 1.0 / (GAMMA * h), 0.0
    for j in range(len(CONTROLLED)):
        k = CONTROLLED[j]
        slope_1 = (first[k] - x[k]) * per_stage
        slope_2 = (last[k] - base[k]) * per_stage
        size = abs(h * (ERROR_0 * slope[k] + ERROR_1 * slope_1 + ERROR_2 * slope_2)) * WEIGHT[j]
        if not size <= error:
            error = size if size > error else inf
    return error


def growth(error: float) -> float:
    """Factor from a step with that error, in tolerances, to the next step [1]."""
    if error <= EASY:
        return GROW
    factor: float = SAFETY * error ** (-1.0 / 3.0)
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
