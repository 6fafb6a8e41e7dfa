"""Gauss panels: the bound on their number of points holds and is not wasteful."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import roots_legendre

from slewctl.model.quadrature import composite, halved, points_needed

EPS = np.finfo(float).eps
KAPPAS = [0.5, 3.0, 20.0, 80.0]
DEGREES = [0, 3, 12]


def exact(kappa: float, degree: int, kind: str) -> float:
    """∫ ξ^d f(κξ) over [−1, 1], f = exp(x − |κ|) or cos, from the antiderivative."""
    with mp.workdps(80):
        rate = mp.mpf(kappa) if kind == "exp" else mp.mpc(0, kappa)
        total = mp.mpf(0)
        for k in range(degree + 1):
            factor = (-1) ** k * mp.factorial(degree) / mp.factorial(degree - k) / rate ** (k + 1)
            total += factor * (mp.exp(rate) - (-1) ** (degree - k) * mp.exp(-rate))
        return float(mp.re(total) * (mp.exp(-kappa) if kind == "exp" else 1))


def gauss(kappa: float, degree: int, kind: str, points: int) -> float:
    x, w = roots_legendre(points)
    f = np.exp(kappa * (x - 1)) if kind == "exp" else np.cos(kappa * x)
    return float(w @ (x**degree * f))


def needed(kappa: float, degree: int) -> int:
    return int(points_needed(np.array([kappa]), degree)[0])


@pytest.mark.parametrize("kappa", KAPPAS)
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("kind", ["exp", "cos"])
def test_points_needed_leave_only_rounding(kappa: float, degree: int, kind: str) -> None:
    """Truncation is below 2⁻⁵³; nodes off by ε/2 turn κξ and ξ^d, and N weights are summed."""
    points = needed(kappa, degree)
    error = abs(gauss(kappa, degree, kind, points) - exact(kappa, degree, kind))
    assert error <= EPS * (1 + kappa + degree + points)


@pytest.mark.parametrize("kappa", KAPPAS)
@pytest.mark.parametrize("degree", DEGREES)
def test_half_the_points_do_not_suffice(kappa: float, degree: int) -> None:
    """Among even and odd powers one integrand shows the shortage."""
    points = (needed(kappa, degree) - 1) // 2
    errors = [
        abs(gauss(kappa, d, "cos", points) - exact(kappa, d, "cos"))
        for d in (degree, degree + degree % 2)
    ]
    assert max(errors) > 1e3 * EPS * (1 + kappa + degree + points)


@pytest.mark.parametrize("degree", range(12))
def test_polynomials_take_exactly_the_points_they_need(degree: int) -> None:
    """N points integrate degree 2N − 1; the N-th Legendre polynomial squared escapes."""
    points = needed(0, degree)
    assert 2 * points - 1 >= degree
    assert 2 * (points - 1) - 1 < degree


def test_more_growth_and_degree_never_take_fewer_points() -> None:
    table = np.array([[needed(k, d) for d in range(0, 40, 4)] for k in (0.1, 1, 10, 100)])
    assert np.all(np.diff(table, axis=0) >= 0)
    assert np.all(np.diff(table, axis=1) >= 0)


@pytest.mark.parametrize("breakpoints", [(), (0.5,), (0.9, 0.1, 0.1, 0.35)])
def test_composite_rule_covers_the_interval_once(breakpoints: tuple[float, ...]) -> None:
    rule = composite(breakpoints, 4.0, 3)
    assert np.all(rule.weights > 0)
    assert np.all(np.diff(rule.xi) > 0)
    assert rule.xi[0] > 0
    assert rule.xi[-1] < 1
    assert rule.weights.sum() == pytest.approx(1, abs=len(rule.xi) * EPS)
    bounds = np.array([0.0, *sorted(set(breakpoints)), 1.0])
    for left, right in pairwise(bounds):
        inside = (rule.xi > left) & (rule.xi < right)
        share = rule.weights[inside].sum()
        assert share == pytest.approx(right - left, abs=len(rule.xi) * EPS)


@pytest.mark.parametrize(
    ("function", "exact_value"),
    [
        (lambda x: np.abs(x - 0.35), (0.35**2 + 0.65**2) / 2),
        (lambda x: np.where(x < 0.35, 1.0, 3.0 * x**2), 0.35 + 1 - 0.35**3),
    ],
    ids=["kink", "step"],
)
def test_composite_rule_is_exact_across_kinks_and_steps(
    function: Callable[[np.ndarray], np.ndarray], exact_value: float
) -> None:
    rule = composite((0.35,), 0.0, 2)
    assert float(rule.weights @ function(rule.xi)) == pytest.approx(exact_value, abs=4 * EPS)


def test_halved_panels_are_halves() -> None:
    assert halved((), 2) == (0.25, 0.5, 0.75)
    assert_allclose(halved((0.2,), 1), [0.1, 0.2, 0.6], rtol=EPS)
    assert halved((0.2,), 0) == (0.2,)
