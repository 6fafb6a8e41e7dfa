"""Roots of the characteristic equations, to machine precision for every index.

Each root is the sum of its asymptote and a correction δ that solves an equation
divided by cosh; δ is found by itself, so that sin and cos at the root keep full
relative accuracy however large the root is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from slewctl._types import Array
from slewctl.errors import check_count


@dataclass(frozen=True, eq=False)
class Roots:
    """The first n roots z = βL of a characteristic equation, with sin z and cos z."""

    z: Array
    sin: Array
    cos: Array


def clamped_free_roots(n: int) -> Roots:
    """Return the first `n` roots of cos z cosh z = −1 (clamped-free beam).

    With z = (2i−1)π/2 + δ the equation divided by cosh z reads
    sin δ = (−1)^(i+1) sech z, which Newton's method solves in a few steps.

    Parameters
    ----------
    n : int
        How many roots.

    Raises
    ------
    InputError
        If n < 1.
    """
    return _clamped_free(check_count(n, "n"))


@lru_cache(maxsize=64)  # every table of functions begins with them
def _clamped_free(n: int) -> Roots:
    i = np.arange(1, n + 1)
    asymptote = (2 * i - 1) * np.pi / 2
    sign = np.where(i % 2 == 1, 1.0, -1.0)
    delta = np.zeros(n)
    for _ in range(8):
        z = asymptote + delta
        sech = 2 * np.exp(-z) / (1 + np.exp(-2 * z))
        residual = np.sin(delta) - sign * sech
        delta -= residual / (np.cos(delta) + sign * sech * np.tanh(z))
    return _kept(asymptote + delta, sign * np.cos(delta), -sign * np.sin(delta))


def slewing_roots(n: int) -> Roots:
    """Return the first `n` positive roots of tan z = tanh z (pinned-free beam, eq. 28).

    With z = (4i+1)π/4 + δ the equation becomes tan δ = −exp(−2z), whose fixed-point
    iteration gains three digits or more a step.

    Parameters
    ----------
    n : int
        How many roots.

    Raises
    ------
    InputError
        If n < 1.
    """
    return _slewing(check_count(n, "n"))


@lru_cache(maxsize=64)
def _slewing(n: int) -> Roots:
    i = np.arange(1, n + 1)
    asymptote = (4 * i + 1) * np.pi / 4
    delta = np.zeros(n)
    for _ in range(8):
        delta = -np.arctan(np.exp(-2 * (asymptote + delta)))
    sign = np.where(i % 2 == 1, -1.0, 1.0) / np.sqrt(2.0)
    return _kept(
        asymptote + delta,
        sign * (np.cos(delta) + np.sin(delta)),
        sign * (np.cos(delta) - np.sin(delta)),
    )


def _kept(*columns: Array) -> Roots:
    """Return roots that nobody changes, for all that ask."""
    for column in columns:
        column.flags.writeable = False
    return Roots(*columns)
