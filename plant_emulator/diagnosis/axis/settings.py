"""All constants of the axis' search and verdict, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The constants; `README.md` of the diagnosis says which data they were tried on.

    worth : share of what is left that an effect has to close on held-out runs; the position's noise
        in a relation is kept below the same share of the force
    systematic : share of what a name leaves that a law may close beside it; laws of a library are
        simple, and a real machine leaves some per cent
    needed : gain of log evidence of an effect: odds of exp(10), against a library of sixteen
    margin : of log evidence within which sets are alternatives: odds of 150 to 1
    most_effects : in a set
    beam : sets that are expanded by one more effect
    friction_spread : prior deviation of a run's own friction [1]; lubricated friction changes by
        some per cent a kelvin
    sure : standard errors from which on two runs differ, among some ten runs
    grid : values of a shape that are tried before it is refined; neighbours differ by about half
    noisy : ratio of mean squares, of what is left and of the sensors' noise, within which the two
        are alike: noise of force and position has other spectra in a relation, and how much of it
        is of either is known to a factor of about two
    """

    worth: float = 0.03
    systematic: float = 0.1
    needed: float = 10.0
    margin: float = 5.0
    most_effects: int = 3
    beam: int = 3
    friction_spread: float = 0.1
    sure: float = 4.0
    grid: int = 9
    noisy: float = 2.0


SETTINGS = Settings()
