"""Clamped-free and slewing functions: accuracy, boundary conditions, orthogonality."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from numpy.testing import assert_allclose
from precise_shapes import shape

from slewctl.basis import Basis, ClampedFree, Slewing

EPS = np.finfo(float).eps
both = pytest.mark.parametrize("kind", [ClampedFree, Slewing])


def gauss(points: int) -> tuple[np.ndarray, np.ndarray]:
    nodes, weights = leggauss(points)
    return (nodes + 1) / 2, weights / 2


def roots(kind: type[Basis], n: int) -> np.ndarray:
    return np.array([kind(i).growth.exponent for i in range(1, n + 1)])


@both
@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_shapes_of_200_functions_are_accurate(kind: type[Basis], derivative: int) -> None:
    """A relative error ε of βL and of ξ turns the angle βLξ by up to 2·βL·ε; rounding adds ε."""
    xi = np.array([0.0, 1e-4, 0.013, 0.37, 0.5, 0.925, 0.999, 1.0])
    computed = kind(200).evaluate(xi, derivative)
    assert np.all(np.isfinite(computed))
    for i in (1, 2, 3, 10, 57, 122, 199, 200):
        exact = np.array([float(shape(kind.name, i, x, derivative)) for x in xi])
        z = kind(i).growth.exponent
        tolerance = (2 * z + 8) * EPS * np.abs(exact).max()
        assert_allclose(computed[:, i - 1], exact, rtol=0, atol=tolerance)


@both
def test_free_end_has_no_moment_and_no_shear(kind: type[Basis]) -> None:
    """φ''(1) = φ'''(1) = 0: then φ''(1 − h) = φ''''(1) h²/2 (1 + O(βh)), with φ'''' ~ z⁴φ."""
    n = 30
    z = roots(kind, n)
    basis = kind(n)
    tip = np.ones(1)
    size = np.abs(basis.evaluate(np.linspace(0, 1, 301), 2)).max(axis=0)
    assert np.all(np.abs(basis.evaluate(tip, 2)[0]) <= 4 * z * EPS * size)
    for i in range(n):
        h = 1e-3 / z[i]
        # φ'''' = z⁴ (φ − its linear part); for the slewing set the root slope is that part.
        linear = _linear_part(kind, i + 1)
        fourth = z[i] ** 4 * (basis.evaluate(tip)[0, i] - linear)
        curvature = basis.evaluate(np.array([1 - h]), 2)[0, i]
        assert curvature == pytest.approx(fourth * h**2 / 2, rel=1e-3)


def _linear_part(kind: type[Basis], i: int) -> float:
    """Slope E of φ = (cosh, sinh, cos, sin) + E x, from the bending part's root slope."""
    if kind is ClampedFree:
        return 0.0
    z = kind(i).growth.exponent
    ratio = np.sin(z) / np.sinh(z)
    return -z * (1 + ratio) / (2 * np.sin(z) - z * (1 + ratio))


def test_slewing_functions_carry_no_moment_at_the_root() -> None:
    basis = Slewing(60)
    assert np.all(basis.evaluate(np.zeros(1), 2) == 0)


def test_slewing_functions_have_unit_tip_displacement() -> None:
    """σ and the sum are each a few roundings."""
    assert_allclose(Slewing(200).evaluate(np.ones(1))[0], 1, rtol=0, atol=8 * EPS)


def test_clamped_free_tip_is_twice_the_sine_combination() -> None:
    """φ_i(1)² = 4 ∫φ_i², the classical property of the free end (Rayleigh)."""
    basis = ClampedFree(20)
    xi, w = gauss(120)
    norms = w @ basis.evaluate(xi) ** 2
    assert_allclose(
        basis.evaluate(np.ones(1))[0] ** 2, 4 * norms, rtol=20 * roots(ClampedFree, 20)[-1] * EPS
    )


def normalised(gram: np.ndarray) -> np.ndarray:
    scale = np.sqrt(np.diag(gram))
    return gram / np.outer(scale, scale)


def test_clamped_free_functions_are_orthogonal_in_displacement_and_curvature() -> None:
    """∫φ_iφ_j = 0 and ∫φ_i''φ_j'' = z_i⁴ ∫φ_i² δ_ij."""
    n = 30
    z = roots(ClampedFree, n)
    xi, w = gauss(200)
    values, curvatures = ClampedFree(n).evaluate(xi), ClampedFree(n).evaluate(xi, 2)
    mass, stiffness = (values.T * w) @ values, (curvatures.T * w) @ curvatures
    tolerance = 4 * z[-1] * EPS  # angles of the highest function
    assert_allclose(normalised(mass), np.eye(n), rtol=0, atol=tolerance)
    assert_allclose(normalised(stiffness), np.eye(n), rtol=0, atol=tolerance)
    assert_allclose(np.diag(stiffness) / np.diag(mass), z**4, rtol=8 * z[-1] * EPS)


def test_slewing_functions_are_pinned_free_modes_minus_their_root_slope() -> None:
    """With the slope put back they are orthogonal to each other and to the rotation x."""
    n = 30
    z = roots(Slewing, n)
    slope = -np.array([_linear_part(Slewing, i) for i in range(1, n + 1)])
    xi, w = gauss(200)
    pinned = np.column_stack([xi, Slewing(n).evaluate(xi) + np.outer(xi, slope)])
    curvatures = Slewing(n).evaluate(xi, 2)
    # φ and slope·x are z times larger than the mode that is their sum.
    tolerance = 4 * z[-1] * EPS * 4
    gram = (pinned.T * w) @ pinned
    assert_allclose(normalised(gram), np.eye(n + 1), rtol=0, atol=tolerance)
    stiffness = (curvatures.T * w) @ curvatures
    assert_allclose(normalised(stiffness), np.eye(n), rtol=0, atol=4 * z[-1] * EPS)
    assert_allclose(np.diag(stiffness) / np.diag(gram)[1:], z**4, rtol=2 * tolerance)


def test_slewing_function_solves_the_slewing_eigenproblem() -> None:
    """φ'''' − z⁴ φ = z⁴ · 3x∫ξφ dξ (eq. 20 mended): here in weak form against x^k, k = 2…5."""
    n = 6
    z = roots(Slewing, n)
    xi, w = gauss(80)
    phi, curvature = Slewing(n).evaluate(xi), Slewing(n).evaluate(xi, 2)
    moment = 3 * (w * xi) @ phi
    for k in range(2, 6):
        bending = (w * k * (k - 1) * xi ** (k - 2)) @ curvature
        inertia = z**4 * ((w * xi**k) @ phi - moment * (w @ xi ** (k + 1)))
        # Terms of size z² cancel between the two sides, each with an error of z·ε.
        assert_allclose(bending, inertia, rtol=0, atol=16 * z[-1] ** 3 * EPS)
