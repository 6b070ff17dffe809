"""One step of SDIRK2: its two stages, its error, and the states in between.

Two-stage, singly diagonally implicit Runge-Kutta method of order 2, L-stable and stiffly accurate
(Alexander, SIAM J. Numer. Anal. 14 (1977) 1006):

    X1 = x + gamma h f(X1)
    X2 = x + (1 - gamma) h f(X1) + gamma h f(X2),   x(t + h) = X2,   gamma = 1 - 1/sqrt(2)

Each stage is X = base + a f(X) with a = gamma h; f(X1) = (X1 - x) / a, so the second base is
x + (1 - gamma)/gamma (X1 - x) and f itself is never evaluated.

Error estimate: the slopes at t, t + gamma h and t + h give a quadrature of order 3; its difference
from the method's is the local error. Where a contact closes or a limit is reached the slopes jump,
and the step shrinks.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import TYPE_CHECKING

from plant_emulator.model.implicit_stage import load, solve_stage, store
from plant_emulator.model.stage import GEAR_SPEED, MOTOR_SPEED

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State

GAMMA = 1.0 - 1.0 / sqrt(2.0)
# Weights of the error estimate: order-3 quadrature at 0, gamma, 1 minus the method's.
_W1 = 1.0 / (6.0 * GAMMA * (1.0 - GAMMA))
_W2 = 0.5 - _W1 * GAMMA
ERROR_0, ERROR_1, ERROR_2 = 1.0 - _W1 - _W2, _W1 - (1.0 - GAMMA), _W2 - GAMMA

# States whose error is controlled, over the size that counts as 1: the range of a full-speed run.
CONTROLLED = (2, 3, 4, 7)
WEIGHT = (1.0 / 70.0, 1.0 / 400.0, 1.0 / 1.2e-3, 1.0 / 6.5)

SHRINK, GROW, SAFETY = 0.2, 5.0, 0.9
SMALLEST_STEP = 1e-6
# Error that a step with an unsettled stage counts as, in tolerances.
UNSETTLED = 1e6
# Below this share of the tolerance a step grows by GROW, above by the root.
EASY = (SAFETY / GROW) ** 3

# Rows of the work space.
FIRST, BASE, LAST, SLOPE = 0, 1, 2, 3


def step(
    h: float, t: float, r: tuple[float, float], x: State, w: State, s: Record, p: Record
) -> None:
    """One step from x at t; its result goes to w[LAST], x stays as it is.

    r : delayed reference at t + gamma h and at t + h [rad/s]
    """
    first, base, last, slope = w[FIRST], w[BASE], w[LAST], w[SLOPE]
    load(x, s)
    s.motor_speed += GAMMA * h * slope[MOTOR_SPEED]
    s.gear_speed += GAMMA * h * slope[GEAR_SPEED]
    s.time, s.delayed_reference = t + GAMMA * h, r[0]
    solve_stage(x, GAMMA * h, s, p)
    store(s, first)
    for k in range(len(x)):
        base[k] = x[k] + (1.0 - GAMMA) / GAMMA * (first[k] - x[k])
    s.motor_speed = x[MOTOR_SPEED] + (first[MOTOR_SPEED] - x[MOTOR_SPEED]) / GAMMA
    s.gear_speed = x[GEAR_SPEED] + (first[GEAR_SPEED] - x[GEAR_SPEED]) / GAMMA
    s.time, s.delayed_reference = t + h, r[1]
    solve_stage(base, GAMMA * h, s, p)
    store(s, last)


def local_error(h: float, x: State, w: State) -> float:
    """Largest local error of the controlled states, each over its scale [1]; a NaN is infinite."""
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
    """Factor to the next step after one of that error, in units of the tolerance [1]."""
    if error <= EASY:
        return GROW
    factor: float = SAFETY * error ** (-1.0 / 3.0)
    return max(SHRINK, factor)


def accept(h: float, x: State, w: State) -> None:
    """Make the step's result the state, and keep its last slope."""
    base, last, slope = w[BASE], w[LAST], w[SLOPE]
    per_stage = 1.0 / (GAMMA * h)
    for k in range(len(x)):
        slope[k] = (last[k] - base[k]) * per_stage
        x[k] = last[k]


def interpolate(since: float, h: float, x: State, w: State) -> State:
    """State a time `since` after the begin of the step: the cubic through both ends and slopes.

    It takes the place of the first stage, which is of no more use.
    """
    first, base, last, slope = w[FIRST], w[BASE], w[LAST], w[SLOPE]
    u = since / h
    rise, start, end = u * u * (3.0 - 2.0 * u), since * (1.0 - u) ** 2, since * u * (u - 1.0)
    per_stage = 1.0 / (GAMMA * h)
    for k in range(len(x)):
        slope_1 = (last[k] - base[k]) * per_stage
        first[k] = x[k] + rise * (last[k] - x[k]) + start * slope[k] + end * slope_1
    return first
