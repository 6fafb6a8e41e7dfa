"""The polynomial basis: orthonormal curvature, and the space it spans."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Legendre
from numpy.testing import assert_allclose
from scipy.special import roots_legendre

from slewctl import InputError
from slewctl.basis import Polynomial

EPS = np.finfo(float).eps


def panel_gauss(edges: tuple[float, ...], points: int) -> tuple[np.ndarray, np.ndarray]:
    nodes, weights = roots_legendre(points)
    bounds = np.array([0.0, *edges, 1.0])
    half, middle = np.diff(bounds) / 2, (bounds[1:] + bounds[:-1]) / 2
    xi = middle[:, None] + half[:, None] * nodes
    return xi.ravel(), (half[:, None] * weights).ravel()


@pytest.mark.parametrize("edges", [(), (0.5,), (0.1, 0.35, 0.8)])
@pytest.mark.parametrize("n", [1, 2, 5, 40, 150])
def test_curvatures_are_orthonormal(edges: tuple[float, ...], n: int) -> None:
    xi, w = panel_gauss(edges, n + 2)
    curvature = Polynomial(n, edges).evaluate(xi, 2)
    # A Gauss point rounded by ε/2 moves φ'' by φ''' ε/2, and |φ'''| < 2 n^1.5 |φ''| in L2.
    tolerance = (2 * n**1.5 + 8) * EPS
    assert_allclose((curvature.T * w) @ curvature, np.eye(n), rtol=0, atol=tolerance)


@pytest.mark.parametrize("n", [1, 2, 3, 6, 10])
def test_span_is_x_squared_times_polynomials(n: int) -> None:
    """The n curvatures span all polynomials of degree < n, and v = ∬v'' from the clamp."""
    basis = Polynomial(n)
    xi, w = panel_gauss((), n + 3)
    curvature = basis.evaluate(xi, 2)
    at = np.linspace(0, 1, 31)
    for k in range(n):
        target = (k + 2) * (k + 1) * xi**k
        coefficients = curvature.T @ (w * target)
        # Rounding of coefficients of size (k + 2)(k + 1), summed over n functions.
        tolerance = 8 * n * (k + 2) * (k + 1) * EPS
        assert_allclose(basis.evaluate(at) @ coefficients, at ** (k + 2), rtol=0, atol=tolerance)
    outside = (n + 2) * (n + 1) * xi**n
    residual = outside - curvature @ (curvature.T @ (w * outside))
    # Distance of x^n from lower degrees: the leading Legendre coefficient n!²/(2n)!.
    assert np.sqrt(w @ residual**2) > 1e-9 * np.sqrt(w @ outside**2)


def test_first_function_is_the_parabola() -> None:
    at = np.linspace(0, 1, 11)
    assert_allclose(Polynomial(1).evaluate(at)[:, 0], at**2 / 2, rtol=0, atol=2 * EPS)


def test_edges_let_the_curvature_jump_and_nothing_else() -> None:
    basis, h = Polynomial(6, (0.4,)), 1e-9
    left, right = np.array([0.4 - h]), np.array([0.4 + h])
    for derivative in (0, 1):
        jump = basis.evaluate(right, derivative) - basis.evaluate(left, derivative)
        slope = np.abs(basis.evaluate(np.linspace(0, 1, 99), derivative + 1)).max()
        assert np.abs(jump).max() <= 2 * h * slope + 4 * EPS
    assert np.abs(basis.evaluate(right, 2) - basis.evaluate(left, 2)).max() > 1.0


def test_edge_point_belongs_to_the_right_panel_and_the_tip_to_the_last() -> None:
    basis = Polynomial(2, (0.4,))
    curvature = basis.evaluate(np.array([0.0, 0.4, 1.0]), 2)
    assert np.all((curvature > 0) == [[True, False], [False, True], [False, True]])


def test_panelled_space_contains_the_plain_one() -> None:
    """Six functions on each panel reproduce the six global polynomials."""
    edges = (0.3, 0.55)
    xi, w = panel_gauss(edges, 9)
    panelled, plain = Polynomial(18, edges), Polynomial(6)
    C = (panelled.evaluate(xi, 2).T * w) @ plain.evaluate(xi, 2)
    at = np.linspace(0, 1, 41)
    assert_allclose(panelled.evaluate(at) @ C, plain.evaluate(at), rtol=0, atol=200 * EPS)


@pytest.mark.parametrize("edges", [(0.0,), (1.0,), (0.5, 0.5), (0.6, 0.4), (-0.1,), (1.5,)])
def test_edges_that_do_not_increase_within_0_to_1_are_refused(edges: tuple) -> None:
    with pytest.raises(InputError) as error:
        Polynomial(3, edges)
    assert error.value.where == "Polynomial.edges"


@pytest.mark.parametrize("edges", [(np.nan,), ("a",)])
def test_edges_that_are_no_numbers_are_refused(edges: tuple) -> None:
    with pytest.raises(InputError):
        Polynomial(3, edges)


def test_edges_may_be_a_list() -> None:
    assert hash(Polynomial(3, [0.5])) == hash(Polynomial(3, (0.5,)))


def integrated(
    xi: np.ndarray, edges: tuple[float, ...], n: int, k: int, derivative: int
) -> np.ndarray:
    """Function k by numpy's own integration of one Legendre polynomial on one panel."""
    bounds = [0.0, *edges, 1.0]
    degree, panel = divmod(k, len(bounds) - 1)
    left, right = bounds[panel], bounds[panel + 1]
    norm = np.sqrt((2 * degree + 1) / (right - left))
    curvature = norm * Legendre.basis(degree, domain=[left, right])
    slope, shape = curvature.integ(1, lbnd=left), curvature.integ(2, lbnd=left)
    here = (xi >= left) & ((xi < right) | (right == 1.0))
    beyond = (slope(right), shape(right) + slope(right) * (xi - right))
    values = (
        np.where(xi < left, 0.0, np.where(here, shape(xi), beyond[1])),
        np.where(xi < left, 0.0, np.where(here, slope(xi), beyond[0])),
        np.where(here, curvature(xi), 0.0),
    )
    return values[derivative]


@pytest.mark.parametrize("edges", [(), (0.4,), (0.1, 0.35, 0.8), tuple(np.arange(1, 40) / 40)])
@pytest.mark.parametrize("n", [1, 2, 7, 45])
@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_sums_panel_by_panel_are_those_of_the_whole_matrix(
    edges: tuple[float, ...], n: int, derivative: int
) -> None:
    """Evaluated, combined and projected: the matrix of all functions, and its transpose."""
    rng = np.random.default_rng(n)
    basis = Polynomial(n, edges)
    xi = np.concatenate([[0.0, 1.0, *edges], rng.uniform(0, 1, 50)])
    matrix = np.column_stack([integrated(xi, edges, n, k, derivative) for k in range(n)])
    # A rounded point moves the Legendre polynomial of degree d by up to d² ε at an edge.
    size = (8 + n**2) * EPS * np.abs(matrix).max()
    assert_allclose(basis.evaluate(xi, derivative), matrix, rtol=0, atol=size)
    given, values = rng.standard_normal((n, 3)), rng.standard_normal((len(xi), 3))
    scale = 8 * EPS * (n + len(xi)) * np.abs(matrix).max()
    assert_allclose(basis.combined(xi, derivative, given), matrix @ given, rtol=0, atol=scale)
    assert_allclose(basis.projected(xi, derivative, values), matrix.T @ values, rtol=0, atol=scale)
