"""The equations of a large slew: their integrals, their invariants and what must not change them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from strategies import arms, deterministic, loaded_arms

from slewctl import (
    AccuracyError,
    Arm,
    Beam,
    ClampedFree,
    Hub,
    InputError,
    Payload,
    Polynomial,
    Slewing,
    Stations,
    assemble,
    truth,
)
from slewctl.basis import Basis
from slewctl.model.nonlinear import LargeDeflectionError, NonlinearModel, large_slew

EPS = np.finfo(float).eps
KINDS = [ClampedFree, Slewing, Polynomial]
kinds = st.sampled_from(KINDS)
every_kind = pytest.mark.parametrize("kind", KINDS)


def random_state(equations: NonlinearModel, seed: int) -> np.ndarray:
    """[θ, q, θ̇, q̇] with a tenth of the largest deflection that the equations allow."""
    rng = np.random.default_rng(seed)
    n = equations.n
    modes = equations.linear.mode_shapes
    state = np.concatenate(
        [rng.normal(size=1), modes[1:, 1:] @ rng.normal(size=n), np.zeros(n + 1)]
    )
    q = state[1 : n + 1]
    state[1 : n + 1] /= 10 * np.sqrt(abs(q @ equations.softening @ q) * equations.compliance[0])
    state[n + 1 :] = modes @ rng.normal(size=n + 1)
    return state


def along(
    function: Callable[[np.ndarray], np.ndarray], state: np.ndarray, rate: np.ndarray
) -> float:
    """Derivative of a polynomial of degree <= 4 along `rate`: five points are exact."""
    one, two = (function(state + k * rate) - function(state - k * rate) for k in (1, 2))
    return float(8 * one - two) / 12


def scaled_rate(
    equations: NonlinearModel, state: np.ndarray, torque: float
) -> tuple[np.ndarray, float]:
    """ẋ·s and s, a step over which no term of the polynomial outgrows the others."""
    rate = equations.derivative(state, torque)
    scale = float(np.max(np.abs(rate) / (np.abs(state) + 1e-300)))
    return rate / scale, scale


@pytest.mark.slow
@every_kind
def test_integrals_equal_adaptive_quadrature(kind: type[Basis], full_arm: Arm) -> None:
    """M_s and K_g against scipy.integrate.quad, the tension P in closed form."""
    equations = large_slew(assemble(full_arm, kind(4)))
    L, r, tip_mass = 1.3, 0.12, 0.4
    mass = np.polynomial.Polynomial([2.0, -0.9 / L])
    pull = (mass * np.polynomial.Polynomial([r, 1.0])).integ()
    basis = kind(4)

    def shape(x: float, i: int, derivative: int = 0) -> float:
        return float(basis.evaluate(np.array([x / L]), derivative)[0, i]) / L**derivative

    def integral(function: Callable[[float], float]) -> float:
        return quad(function, 0, L, epsabs=1e-12, epsrel=1e-12, limit=200)[0]

    for i in range(4):
        for j in range(4):
            carried = integral(lambda x: mass(x) * shape(x, i) * shape(x, j))  # noqa: B023
            carried += tip_mass * shape(L, i) * shape(L, j)
            stiff = integral(
                lambda x: (pull(L) - pull(x) + tip_mass * (r + L)) * shape(x, i, 1) * shape(x, j, 1)  # noqa: B023
            )
            for found, expected in (
                (equations.carried_mass, carried),
                (equations.geometric_stiffness, stiff),
            ):
                size = np.sqrt(found[i, i] * found[j, j])
                assert found[i, j] == pytest.approx(expected, abs=1e-12 * size)


def test_geometric_stiffness_of_one_polynomial_by_hand() -> None:
    """φ = ξ²/2: K_g = m̄(r/12 + L/15) + m_t(r+L)/(3L), M_s = m̄L/20 + m_t/4."""
    m, L, r, mt = 3.0, 2.0, 0.25, 0.7
    arm = Arm(Beam(L, m, 5.0), Hub(0.5, r), Payload(mt, 0.1))
    equations = large_slew(assemble(arm, Polynomial(1)))
    K_g = m * (r / 12 + L / 15) + mt * (r + L) / (3 * L)
    assert equations.geometric_stiffness[0, 0] == pytest.approx(K_g, rel=16 * EPS)
    assert equations.carried_mass[0, 0] == pytest.approx(m * L / 20 + mt / 4, rel=16 * EPS)


def test_step_of_the_mass_by_hand() -> None:
    """m̄ = 2 up to a = 0.4, then 1: ∫P ξ² = 2a⁵/15 + (1 − a⁵)/15 for φ = ξ²/2, r = 0.

    Swapping the integrals, ∫P x² dx = ∫ m̄(s) s (s³/3) ds = Σ m̄ Δ(s⁵)/15.
    """
    a = 0.4
    table = Stations((0, a, a, 1), (2, 2, 1, 1))
    equations = large_slew(assemble(Arm(Beam(1.0, table, 1.0)), Polynomial(1)))
    expected = (2 * a**5 + 1 - a**5) / 15
    assert equations.geometric_stiffness[0, 0] == pytest.approx(expected, rel=16 * EPS)


@every_kind
def test_callable_profile_gives_what_the_polynomial_gives(kind: type[Basis]) -> None:
    hub, payload = Hub(0.1, 0.2), Payload(0.3, 0.01)
    pairs = [((2.0, 0.0, -0.9), lambda x: 2 - 0.9 * (x / 2) ** 2), (3.0, lambda x: 3.0)]
    for spec, function in pairs:
        exact = large_slew(assemble(Arm(Beam(2.0, spec, 1.0), hub, payload), kind(5)))
        sampled = large_slew(assemble(Arm(Beam(2.0, function, 1.0), hub, payload), kind(5)))
        for name in ("carried_mass", "geometric_stiffness"):
            a, b = getattr(exact, name), getattr(sampled, name)
            size = np.sqrt(np.outer(np.diag(a), np.diag(a)))
            # The tolerance of the refinement and the rounding of some hundred terms.
            assert np.all(np.abs(a - b) <= (1e-12 + 200 * EPS) * size)


def test_smooth_callable_settles_on_the_closed_form() -> None:
    """m̄ = exp(−x), φ = ξ²/2: K_g = ∫ exp(−s) s⁴/3 ds = (24 − 65/e)/3."""
    equations = large_slew(assemble(Arm(Beam(1.0, lambda x: np.exp(-x), 1.0)), Polynomial(1)))
    expected = (24 - 65 / np.e) / 3
    # 24 − 65/e cancels three digits.
    assert equations.geometric_stiffness[0, 0] == pytest.approx(expected, rel=1e-12 + 2000 * EPS)


def test_callable_with_a_step_is_refused() -> None:
    stepped = Arm(Beam(1.0, lambda x: np.where(x < 0.3, 2.0, 1.0), 1.0))
    with pytest.raises(AccuracyError, match="Stations"):
        large_slew(replace_arm(assemble(Arm(Beam(1.0, 1.0, 1.0)), Slewing(3)), stepped))


def replace_arm(model: object, arm: Arm) -> object:
    """A model as if `arm` had been assembled, which it refuses on its own account."""
    return replace(model, arm=arm)


@given(arms(), kinds, st.integers(1, 10))
@deterministic(60)
def test_matrices_are_symmetric_and_tension_outweighs_softening(
    arm: Arm, kind: type[Basis], n: int
) -> None:
    """K_g > 0, and M_s − K_g <= 0: a string clamped at r >= 0 has no frequency below its spin."""
    equations = large_slew(assemble(arm, kind(n)))
    for matrix in (equations.carried_mass, equations.geometric_stiffness, equations.softening):
        assert_array_equal(matrix, matrix.T)
    scale = 1 / np.sqrt(np.diag(equations.geometric_stiffness))
    outer = np.outer(scale, scale)
    assert np.linalg.eigvalsh(equations.geometric_stiffness * outer)[0] > -10 * n * EPS
    assert np.linalg.eigvalsh(equations.softening * outer)[-1] < 10 * n * EPS
    assert_array_equal(
        large_slew(equations.linear, stiffening=False).softening, equations.carried_mass
    )


@given(arms(), kinds, st.integers(1, 6))
@deterministic(30)
def test_carried_mass_is_the_mass_without_the_rotary_inertia(
    arm: Arm, kind: type[Basis], n: int
) -> None:
    model = assemble(arm, kind(n))
    turn = kind(n).evaluate(np.ones(1), 1)[0] / arm.beam.length
    total = large_slew(model).carried_mass + arm.payload.inertia * np.outer(turn, turn)
    size = np.sqrt(np.outer(np.diag(total), np.diag(total)))
    assert np.all(np.abs(total - model.mass[1:, 1:]) <= 20 * EPS * size)


@given(loaded_arms(), kinds, st.integers(1, 6), st.booleans(), st.integers(0, 99))
@deterministic(60)
def test_accelerations_solve_the_equations(
    arm: Arm, kind: type[Basis], n: int, stiffening: bool, seed: int
) -> None:
    """The two equations of the module's docstring, written out."""
    model = assemble(arm, kind(n))
    equations = large_slew(model, stiffening)
    x, rates = np.split(random_state(equations, seed), 2)
    torque = 0.7
    acceleration = equations.accelerations(x, rates, torque)
    S, (theta_dot, q_dot), q = equations.softening, (rates[0], rates[1:]), x[1:]
    J, coupling = model.mass[0, 0], model.mass[0, 1:]
    drag = model.damping @ rates
    terms = [
        (J + q @ S @ q) * acceleration[0],
        2 * theta_dot * (q @ S @ q_dot),
        coupling @ acceleration[1:],
        drag[0] - torque,
    ]
    rows = [
        coupling * acceleration[0],
        model.mass[1:, 1:] @ acceleration[1:],
        drag[1:],
        model.stiffness[1:, 1:] @ q,
        -(theta_dot**2) * (S @ q),
    ]
    # The modes solve M only to ε·cond(M), in modal coordinates; residuals are compared there.
    residual = model.mode_shapes.T @ np.concatenate([[sum(terms)], np.sum(rows, axis=0)])
    sizes = [
        model.mode_shapes.T @ np.concatenate([[a], b])
        for a, b in zip([0, *terms], rows, strict=True)
    ]
    scale = np.linalg.cond(model.mass * np.outer(*[1 / np.sqrt(np.diag(model.mass))] * 2))
    assert np.linalg.norm(residual) <= 100 * EPS * scale * max(map(np.linalg.norm, sizes))


@given(loaded_arms(), kinds, st.integers(1, 6), st.booleans(), st.integers(0, 99))
@deterministic(60)
def test_power_and_momentum_balance(
    arm: Arm, kind: type[Basis], n: int, stiffening: bool, seed: int
) -> None:
    """dE/dt = τθ̇ − ẋᵀDẋ, and the momentum about the axis changes with τ − (Dẋ)_θ alone."""
    equations = large_slew(assemble(arm, kind(n)), stiffening)
    state = random_state(equations, seed)
    torque, D = 0.7, equations.linear.damping
    rates = state[n + 1 :]
    rate, scale = scaled_rate(equations, state, torque)
    power = torque * rates[0] - rates @ D @ rates
    # The differences of energies lose what these exceed the power by.
    size = equations.energy(np.abs(state) + np.abs(rate)) + sum(
        abs(equations.energy(state + k * rate)) for k in (-2, -1, 1, 2)
    )
    assert along(equations.energy, state, rate) * scale == pytest.approx(
        power, abs=1e4 * EPS * size * scale + 1e-12 * abs(power)
    )
    force = torque - (D @ rates)[0]
    size = np.abs(equations.linear.mass[0]) @ (np.abs(rates) + np.abs(rate[n + 1 :]))
    assert along(equations.angular_momentum, state, rate) * scale == pytest.approx(
        force, abs=1e4 * EPS * (size + abs(force)) * scale
    )


def test_energy_is_that_of_the_moving_beam(full_arm: Arm) -> None:
    """½∫m̄[((r+x)θ̇+v̇)² + v²θ̇²] − ½θ̇²∫Pv'² + payload and hub + ½∫EI v''², by quad."""
    n, L, r = 3, 1.3, 0.12
    equations = large_slew(assemble(full_arm, ClampedFree(n)))
    state = np.array([0.3, 0.05, -0.02, 0.01, 1.7, 0.4, -0.3, 0.2])
    q, w, q_dot = state[1:4], state[4], state[5:]
    mass = np.polynomial.Polynomial([2.0, -0.9 / L])
    pull = (mass * np.polynomial.Polynomial([r, 1.0])).integ()

    def field(x: float, coordinates: np.ndarray, derivative: int = 0) -> float:
        return (
            float(ClampedFree(n).evaluate(np.array([x / L]), derivative)[0] @ coordinates)
            / L**derivative
        )

    def density(x: float) -> float:
        speed = ((r + x) * w + field(x, q_dot)) ** 2 + (field(x, q) * w) ** 2
        tension = pull(L) - pull(x) + 0.4 * (r + L)
        bending = (40 - 25 * (x / L) ** 2) * field(x, q, 2) ** 2
        return mass(x) * speed - w**2 * tension * field(x, q, 1) ** 2 + bending

    beam = quad(density, 0, L, epsrel=1e-13, limit=200)[0]
    tip = 0.4 * (((r + L) * w + field(L, q_dot)) ** 2 + (field(L, q) * w) ** 2)
    tip += 0.02 * (w + field(L, q_dot, 1)) ** 2 + 0.7 * w**2
    assert equations.energy(state) == pytest.approx((beam + tip) / 2, rel=1e-12)


@given(arms(damping=True), kinds, st.integers(1, 6), st.booleans(), st.integers(0, 99))
@deterministic(40)
def test_turned_and_mirrored_arms_move_alike(
    arm: Arm, kind: type[Basis], n: int, stiffening: bool, seed: int
) -> None:
    equations = large_slew(assemble(arm, kind(n)), stiffening)
    state = random_state(equations, seed)
    rate = equations.derivative(state, 0.7)
    turned = state.copy()
    turned[0] += 1234.5
    assert_array_equal(equations.derivative(turned, 0.7), rate)
    assert_array_equal(equations.derivative(-state, -0.7), -rate)
    assert equations.energy(-state) == equations.energy(state)


def test_units_do_not_matter() -> None:
    """The same arm in mm: m̄ /10³, EI ·10⁹, J ·10⁶, torque ·10⁶; angles are angles."""
    metres = Arm(Beam(1.3, (2.0, -0.9), 40.0), Hub(0.7, 0.12, 0.3), Payload(0.4, 0.02), 0.01)
    milli = Arm(
        Beam(1300.0, (2e-3, -0.9e-3), 40e9), Hub(0.7e6, 120.0, 0.3e6), Payload(0.4, 0.02e6), 0.01
    )
    a, b = (large_slew(assemble(arm, Slewing(4))) for arm in (metres, milli))
    state = random_state(a, 1)
    units = np.array([1.0, *[1e3] * 4, 1.0, *[1e3] * 4])
    assert_allclose(
        b.derivative(units * state, 0.7e6) / units, a.derivative(state, 0.7), rtol=1e-10
    )
    assert b.energy(units * state) == pytest.approx(1e6 * a.energy(state), rel=1e-12)


def test_truth_has_the_same_equations_in_its_own_modes(full_arm: Arm) -> None:
    """The truth's S, in the modes of a polynomial basis as rich as its own."""
    exact = truth(full_arm, 3)
    equations = large_slew(exact)
    rich = assemble(full_arm, Polynomial(24))
    S = large_slew(rich).softening
    modes = rich.mode_shapes[1:, 1:4]
    own = exact.mode_shapes[1:, 1:]
    expected = modes.T @ S @ modes
    assert_allclose(
        own.T @ equations.softening @ own, expected, rtol=1e-7, atol=1e-9 * abs(expected[0, 0])
    )


def test_too_large_a_deflection_is_refused() -> None:
    """Without hub inertia the second-order shortening soon takes all that a torque meets."""
    equations = large_slew(assemble(Arm(Beam(1.0, 1.0, 1.0)), ClampedFree(5)))
    q = equations.linear.mode_shapes[1:, 1]
    limit = 1 / np.sqrt(-(q @ equations.softening @ q) * equations.compliance[0])
    rest = np.zeros(6)
    near = np.concatenate([[0.0], 0.999 * limit * q])
    assert np.all(np.isfinite(equations.accelerations(near, rest, 0.0)))
    with pytest.raises(
        LargeDeflectionError, match=r"tip deflection of 0\.033.* m .* hub its inertia"
    ):
        equations.accelerations(np.concatenate([[0.0], 1.001 * limit * q]), rest, 0.0)
    # Without stiffening the deflection adds inertia, however large.
    softer = large_slew(equations.linear, stiffening=False)
    assert np.all(np.isfinite(softer.accelerations(np.concatenate([[0.0], 1e3 * q]), rest, 0.0)))


def test_equations_cannot_be_changed_and_refuse_what_is_no_model(full_arm: Arm) -> None:
    equations = large_slew(assemble(full_arm, Slewing(2)))
    for name in ("carried_mass", "geometric_stiffness", "softening"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(equations, name)[0] = 1.0
    with pytest.raises(InputError, match=r"large_slew: .* is not a model; give one"):
        large_slew(full_arm)
