"""What every basis keeps, whatever its functions: one contract over all of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from numpy.testing import assert_allclose, assert_array_equal

from slewctl import Arm, Beam, Hub, InputError, Payload, Stations, assemble
from slewctl.basis import (
    BASES,
    NAMES,
    ArmMatched,
    Basis,
    ClampedFree,
    Combined,
    HubMatched,
    Polynomial,
    Ratios,
    Slewing,
    WithStatic,
    create,
)

EPS = np.finfo(float).eps
EDGES = (0.3, 0.55)
STEP = Stations((0.0, 0.4, 0.4, 1.0), (3.0, 3.0, 1.0, 1.0))
ARM = Arm(Beam(1.0, STEP, (2.0, 0.0, -1.0)), Hub(0.3, 0.1), Payload(0.4, 0.05))


def panelled(n: int) -> Basis:
    return Polynomial(n, EDGES)


def combined(n: int) -> Basis:
    """Two-term combinations of a clamped-free parent."""
    return Combined(n, ClampedFree(n + 1), np.eye(n + 1, n) + np.eye(n + 1, n, -1))


def hub_matched(n: int) -> Basis:
    """Some slow functions in Krylov's form, the others in exponentials."""
    return HubMatched(n, Ratios(0.2, 0.1, 5.0, 0.3))


def arm_matched(n: int) -> Basis:
    return ArmMatched(n).matched_to(ARM)


def with_static(n: int) -> Basis:
    """The static shape after n − 1 others, or alone."""
    with_it = WithStatic(ClampedFree(max(n - 1, 1)), ARM)
    return with_it if n > 1 else with_it.static


KINDS: list[Callable[[int], Basis]] = [
    ClampedFree,
    Slewing,
    Polynomial,
    panelled,
    combined,
    hub_matched,
    arm_matched,
    with_static,
]
every_basis = pytest.mark.parametrize("make", KINDS, ids=lambda make: make.__name__)
every_n = pytest.mark.parametrize("n", [1, 2, 3, 8, 30])


def wavenumber(basis: Basis) -> float:
    """How fast shapes vary: the last root, or n² for polynomials (Markov's inequality)."""
    return max(basis.growth.exponent, float(basis.n**2), 1.0)


def size(basis: Basis, derivative: int) -> np.ndarray:
    """Largest value of each function on a fine grid."""
    return np.abs(basis.evaluate(np.linspace(0, 1, 401), derivative)).max(axis=0)


def cells(basis: Basis) -> np.ndarray:
    return np.union1d(np.linspace(0, 1, 2 * basis.n + 5), basis.breakpoints)


def integrals(basis: Basis, derivative: int) -> np.ndarray:
    """∫ of a derivative over each cell, with 24 Gauss points: exact to rounding there."""
    nodes, weights = leggauss(24)
    bounds = cells(basis)
    half, middle = np.diff(bounds) / 2, (bounds[1:] + bounds[:-1]) / 2
    xi = middle[:, None] + half[:, None] * nodes
    values = basis.evaluate(xi.ravel(), derivative).reshape(*xi.shape, basis.n)
    return half[:, None] * np.einsum("g,cgn->cn", weights, values)


@every_basis
@every_n
def test_shapes_are_admissible(make: Callable[[int], Basis], n: int) -> None:
    """φ(0) = φ'(0) = 0, to rounding of terms as large as the functions themselves."""
    basis = make(n)
    root = np.zeros(1)
    for derivative in (0, 1):
        assert np.all(
            np.abs(basis.evaluate(root, derivative)[0]) <= 8 * EPS * size(basis, derivative)
        )


@every_basis
@every_n
@pytest.mark.parametrize("derivative", [0, 1])
def test_derivatives_are_derivatives(make: Callable[[int], Basis], n: int, derivative: int) -> None:
    """∫ φ⁽ᵈ⁺¹⁾ over a cell is the difference of φ⁽ᵈ⁾ at its ends (exact, unlike differences)."""
    basis = make(n)
    differences = np.diff(basis.evaluate(cells(basis), derivative), axis=0)
    # An argument's rounding ε moves φ by φ' ε; values themselves carry a few ε.
    scale = 8 * EPS * (size(basis, derivative) * 4 + size(basis, derivative + 1))
    error = np.abs(integrals(basis, derivative + 1) - differences)
    assert np.all(error <= scale)


@every_basis
@pytest.mark.parametrize("derivative", [1, 2])
def test_derivative_against_finite_differences(
    make: Callable[[int], Basis], derivative: int
) -> None:
    """A fourth-order stencil halves its error 16-fold: the rate shows that nothing else is off."""
    basis = make(5)
    xi = np.array([0.11, 0.42, 0.71, 0.93])

    def error(h: float) -> np.ndarray:
        at = [basis.evaluate(xi + k * h, derivative - 1) for k in (-2, -1, 1, 2)]
        slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h)
        return np.abs(slope - basis.evaluate(xi, derivative)).max()

    exact_for_polynomials = 1e-9 * size(basis, derivative).max()
    coarse, fine = error(0.02), error(0.01)
    assert fine <= max(coarse / 12, exact_for_polynomials)
    assert error(0.002) <= 1e-3 * size(basis, derivative).max()


@every_basis
@every_n
def test_shapes_have_one_row_a_point_and_one_column_a_function(
    make: Callable[[int], Basis], n: int
) -> None:
    basis = make(n)
    xi = np.array([0.0, 0.2, 0.3, 0.55, 1.0])
    for derivative in (0, 1, 2):
        together = basis.evaluate(xi, derivative)
        assert together.shape == (5, n)
        alone = np.vstack([basis.evaluate(xi[k : k + 1], derivative) for k in range(5)])
        # Matrix products may sum in another order: a few units in the last place.
        assert_allclose(together, alone, rtol=0, atol=8 * EPS * size(basis, derivative).max())


@every_basis
@every_n
def test_functions_are_linearly_independent(make: Callable[[int], Basis], n: int) -> None:
    basis = make(n)
    curvatures = basis.evaluate(np.linspace(0, 1, 400), 2)
    curvatures /= np.linalg.norm(curvatures, axis=0)
    # Near-orthogonal curvature: the columns are far from dependent, not just not dependent.
    assert np.linalg.svd(curvatures, compute_uv=False)[-1] > 1e-2 / n


@pytest.mark.parametrize("make", [ClampedFree, Slewing, Polynomial, panelled, hub_matched])
@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_smaller_basis_is_the_beginning_of_the_larger(
    make: Callable[[int], Basis], derivative: int
) -> None:
    xi = np.linspace(0, 1, 23)
    large = make(12).evaluate(xi, derivative)
    for n in range(1, 12):
        assert_array_equal(make(n).evaluate(xi, derivative), large[:, :n])


@every_basis
@every_n
def test_growth_bounds_the_shapes(make: Callable[[int], Basis], n: int) -> None:
    """A shape of frequency κ and degree d has at most κ/π + d + 2 zeros in [0, 1]."""
    basis = make(n)
    values = basis.evaluate(np.linspace(0.01, 1, 4001))
    changes = (np.diff(np.sign(values), axis=0) != 0).sum(axis=0)
    assert np.all(changes <= basis.growth.exponent / np.pi + basis.growth.degree + 2)
    assert basis.growth.exponent >= 0


@pytest.mark.parametrize("kind", list(BASES.values()))
@pytest.mark.parametrize("n", [0, -1, 2.0, 1.5, True, "3", None, np.nan])
def test_impossible_numbers_of_functions_are_refused(kind: type[Basis], n: object) -> None:
    with pytest.raises(InputError) as error:
        kind(n)
    assert error.value.where == f"{kind.__name__}.n"
    assert "whole number >= 1" in str(error.value)


@pytest.mark.parametrize("name", NAMES)
def test_create_finds_a_basis_by_name(name: str) -> None:
    assert create(name, 3) == BASES[name](3)
    assert create(name, 3).name == name
    assert hash(create(name, 3)) == hash(BASES[name](3))
    assert create(name, 3) != BASES[name](4)


DEPENDENT = [HubMatched(3), ArmMatched(3), WithStatic(ClampedFree(2)), WithStatic(HubMatched(2))]


@pytest.mark.parametrize("basis", DEPENDENT, ids=lambda basis: basis.name)
def test_a_description_is_matched_to_the_arm_at_hand(basis: Basis) -> None:
    """The same description gives each arm its own functions, the same ones every time."""
    other = Arm(ARM.beam)
    for arm in (ARM, other):
        matched = basis.matched_to(arm)
        assert (matched.n, matched.name) == (3, basis.name)
        assert matched == basis.matched_to(arm)
        assert hash(matched) == hash(basis.matched_to(arm))
        assert matched.matched_to(ARM) == matched
        assert assemble(arm, basis).basis == matched
        assert_array_equal(assemble(arm, basis).mass, assemble(arm, matched).mass)
    assert basis.matched_to(ARM) != basis.matched_to(other)


@pytest.mark.parametrize("basis", DEPENDENT, ids=lambda basis: basis.name)
def test_functions_of_no_arm_are_refused(basis: Basis) -> None:
    for ask in (
        lambda: basis.evaluate(np.ones(1)),
        lambda: basis.growth,
    ):
        with pytest.raises(InputError, match="depend on the arm") as error:
            ask()
        assert "assemble" in error.value.remedy
    with pytest.raises(InputError, match="not an Arm"):
        basis.matched_to(0.5)


def test_given_ratios_are_kept_on_every_arm() -> None:
    fixed = HubMatched(3, Ratios(0.2))
    assert assemble(ARM, fixed).basis == fixed


def test_create_suggests_the_nearest_name() -> None:
    with pytest.raises(InputError, match="did you mean 'slewing'"):
        create("slewin", 3)
    with pytest.raises(InputError, match="known: arm-matched, clamped-free, hub-matched, "):
        create("xyz", 3)


def test_combined_is_a_linear_combination() -> None:
    parent = Slewing(4)
    C = np.array([[1.0, 0.5], [0.0, -2.0], [3.0, 0.0], [0.0, 1.0]])
    basis = Combined(2, parent, C)
    xi = np.linspace(0, 1, 9)
    for derivative in (0, 1, 2):
        expected = [
            sum(C[k, j] * parent.evaluate(xi, derivative)[:, k] for k in range(4)) for j in range(2)
        ]
        scale = 16 * EPS * size(parent, derivative).max() * 3
        assert_allclose(basis.evaluate(xi, derivative), np.transpose(expected), rtol=0, atol=scale)
    assert basis.growth == parent.growth
    assert Combined(2, panelled(4), C).breakpoints == EDGES


def test_combined_refuses_coefficients_of_another_shape() -> None:
    with pytest.raises(InputError):
        Combined(3, Polynomial(2), np.eye(2))


@every_basis
def test_third_derivative_is_refused(make: Callable[[int], Basis]) -> None:
    with pytest.raises(InputError):
        make(3).evaluate(np.ones(1), 3)
