"""M, D, K and the modes: their structure, their integrals and what must not change them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from scipy.linalg import eigh, expm
from strategies import arms, deterministic, loaded_arms

from slewctl import (
    AccuracyError,
    Arm,
    Beam,
    ClampedFree,
    Drag,
    Hub,
    InputError,
    LumpedMass,
    Payload,
    Polynomial,
    Slewing,
    Stations,
    assemble,
    truth,
)
from slewctl.basis import Basis
from slewctl.model import Model

EPS = np.finfo(float).eps
KINDS = [ClampedFree, Slewing, Polynomial]
kinds = st.sampled_from(KINDS)
every_kind = pytest.mark.parametrize("kind", KINDS)


@given(loaded_arms(), kinds, st.integers(1, 10))
@deterministic(60)
def test_matrices_are_symmetric_and_definite(arm: Arm, kind: type[Basis], n: int) -> None:
    model = assemble(arm, kind(n))
    for matrix in (model.mass, model.stiffness):
        assert matrix.shape == (n + 1, n + 1)
        assert_array_equal(matrix, matrix.T)
    # D_ij sums n products of momenta, in two orders for ij and ji.
    D = model.damping
    assert np.all(np.abs(D - D.T) <= n * EPS * np.sqrt(np.outer(np.diag(D), np.diag(D))))
    scale = 1 / np.sqrt(np.diag(model.mass))
    assert np.linalg.eigvalsh(model.mass * np.outer(scale, scale))[0] > 0
    assert_array_equal(model.stiffness[0], 0)
    flexible = model.stiffness[1:, 1:]
    scale = 1 / np.sqrt(np.diag(flexible))
    assert np.linalg.eigvalsh(flexible * np.outer(scale, scale))[0] > 0
    assert_array_equal(model.input, np.eye(n + 1)[0])
    assert np.all(model.omega > 0)
    assert np.all(np.diff(model.omega) >= 0)
    assert_array_equal(model.frequencies_hz, model.omega / (2 * np.pi))


@given(arms(damping=True), kinds, st.integers(1, 10))
@deterministic(60)
def test_modes_diagonalise_mass_stiffness_and_damping(arm: Arm, kind: type[Basis], n: int) -> None:
    """UᵀMU = I, UᵀKU = diag(0, ω²), UᵀDU = c_h u₀u₀ᵀ + diag(0, 2ζω), to rounding.

    Each bound has the rounding of the products and that of U: the singular vectors of
    R₂T⁻¹ leave ε·ω_n/ω_1 in the mass and T⁻¹ leaves ε·cond(T) in the stiffness.
    """
    model = assemble(arm, kind(n))
    U, omega = model.mode_shapes, model.omega
    W = np.abs(U.T) @ np.abs(model.mass) @ np.abs(U)
    unit = 4 * (n + 1) * EPS
    error = np.abs(U.T @ model.mass @ U - np.eye(n + 1))
    assert np.all(error <= unit * (W + omega[-1] / omega[0]))
    rates = np.array([0, *omega])
    condition = np.sqrt(np.linalg.cond(model.stiffness[1:, 1:]))
    error = np.abs(U.T @ model.stiffness @ U - np.diag(rates**2))
    size = np.abs(U.T) @ np.abs(model.stiffness) @ np.abs(U)
    assert np.all(error <= unit * (size + condition * np.outer(rates, rates)))
    # D is made of the momenta MU, each a sum in which terms |M||U| cancel.
    modal = np.diag(2 * arm.damping_ratio * rates)
    friction = arm.hub.friction * np.outer(U[0], U[0])
    spread = W + omega[-1] / omega[0]
    bound = unit * (W @ modal @ spread + spread @ modal @ W + np.abs(friction))
    assert np.all(np.abs(U.T @ model.damping @ U - modal - friction) <= bound)
    assert_array_equal(model.damping[0, 1:], 0)
    assert model.damping[0, 0] == arm.hub.friction
    assert_array_equal(U[1:, 0], 0)


@given(arms(), kinds, st.integers(1, 8))
@deterministic(40)
def test_frequencies_are_the_generalised_eigenvalues(arm: Arm, kind: type[Basis], n: int) -> None:
    """Against LAPACK on K and M themselves, with the error bound of its users' guide:

    ε (‖K‖ ‖M⁻¹‖ + cond(M) λ) times a modest function of n.
    """
    model = assemble(arm, kind(n))
    M, K, squared = model.mass, model.stiffness, model.omega**2
    expected = eigh(K, M, eigvals_only=True)[1:]
    shift = np.linalg.norm(K, 2) * np.linalg.norm(np.linalg.inv(M), 2)
    bound = 4 * (n + 1) * EPS * (shift + np.linalg.cond(M) * squared)
    assert np.all(np.abs(squared - expected) <= bound)


@given(arms(), kinds)
@deterministic(40)
def test_frequencies_fall_towards_the_truth(arm: Arm, kind: type[Basis]) -> None:
    """Ritz: in nested spaces no frequency rises with n, and none falls below the exact one."""
    panels = arm.beam.breakpoints if kind is Polynomial else ()
    exact = truth(arm, 8)
    previous = np.full(9, np.inf)
    for n in range(1, 9):
        basis = Polynomial(n, panels) if panels else kind(n)
        omega = assemble(arm, basis).omega
        rounding = 50 * n * EPS * omega / omega[0]
        assert np.all(omega <= previous[:n] * (1 + rounding))
        assert np.all(omega >= exact.omega[:n] * (1 - rounding - exact.frequency_errors[:n]))
        previous = np.append(omega, np.inf)


@given(arms())
@deterministic(40)
def test_hub_locked_frequencies_interlace_with_the_free_ones(arm: Arm) -> None:
    """Locking θ is one constraint: ω_k(locked) <= ω_k(free) <= ω_{k+1}(locked)."""
    model = assemble(arm, Polynomial(10, arm.beam.breakpoints))
    locked = np.sqrt(eigh(model.stiffness[1:, 1:], model.mass[1:, 1:], eigvals_only=True))
    slack = 1e-9  # squared sums leave ε·(ω_10/ω_1)² ~ 1e-10 in the locked frequencies
    assert np.all(locked <= model.omega * (1 + slack))
    assert np.all(model.omega[:-1] <= locked[1:] * (1 + slack))


def rescaled(arm: Arm, length: float, mass: float, time: float) -> Arm:
    """The same arm measured in units that are smaller by these factors."""

    def profile(spec: object, factor: float) -> object:
        if isinstance(spec, Stations):
            return Stations([x * length for x in spec.x], [v * factor for v in spec.values])
        return tuple(c * factor for c in (spec if isinstance(spec, tuple) else (spec,)))

    return Arm(
        Beam(
            arm.beam.length * length,
            profile(arm.beam.mass_per_length, mass / length),
            profile(arm.beam.bending_stiffness, mass * length**3 / time**2),
        ),
        Hub(
            arm.hub.inertia * mass * length**2,
            arm.hub.radius * length,
            arm.hub.friction * mass * length**2 / time,
        ),
        Payload(arm.payload.mass * mass, arm.payload.inertia * mass * length**2),
        damping_ratio=arm.damping_ratio,
        damping=arm.damping and Drag(arm.damping.per_length * mass / (length * time)),
        masses=[
            LumpedMass(m.x * length, m.mass * mass, m.inertia * mass * length**2)
            for m in arm.masses
        ],
        damping_modes=arm.damping_modes,
    )


@given(loaded_arms(), kinds, *[st.floats(-3, 3)] * 3)
@deterministic(40)
def test_change_of_units_scales_everything_consistently(
    arm: Arm, kind: type[Basis], a: float, b: float, c: float
) -> None:
    """In units scaled by L, m and t: ω/t; M, D and K by m, m/t, m/t² (q is a length, θ none)."""
    length, mass, time = 10.0**a, 10.0**b, 10.0**c
    model = assemble(arm, kind(6))
    other = assemble(rescaled(arm, length, mass, time), kind(6))
    rounding = 200 * EPS
    assert_allclose(
        other.omega * time, model.omega, rtol=rounding * model.omega[-1] / model.omega[0]
    )
    units = np.outer(*[np.array([length, *[1.0] * 6])] * 2)
    for name, factor in (("mass", mass), ("stiffness", mass / time**2)):
        expected = getattr(model, name) * units * factor
        size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        error = np.abs(getattr(other, name) - expected)
        assert np.all(error <= rounding * size)
    expected = model.damping * units * mass / time
    # Damping is made of the modes and inherits their conditioning.
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected))) + 1e-300
    spread = model.omega[-1] / model.omega[0]
    assert np.all(np.abs(other.damping - expected) <= 10 * rounding * spread * size)


@every_kind
def test_integrals_agree_with_adaptive_quadrature(kind: type[Basis], full_arm: Arm) -> None:
    """Every entry of M and K by scipy's QUADPACK, to its requested 1e-12."""
    model, basis, L, r = assemble(full_arm, kind(3)), kind(3), 1.3, 0.12

    def m(x: float) -> float:
        return 2.0 - 0.9 * x / L

    def EI(x: float) -> float:
        return 40.0 - 25.0 * (x / L) ** 2

    def v(x: float, derivative: int = 0) -> np.ndarray:
        return basis.evaluate(np.array([x / L]), derivative)[0] / L**derivative

    def w(x: float) -> np.ndarray:
        return np.array([r + x, *v(x)])

    def adaptive(i: int, j: int) -> tuple[float, float]:
        inertia = quad(lambda x: m(x) * w(x)[i] * w(x)[j], 0, L, epsabs=0, epsrel=1e-12)[0]
        if not i or not j:
            return inertia, 0.0
        bend = quad(lambda x: EI(x) * v(x, 2)[i - 1] * v(x, 2)[j - 1], 0, L, epsabs=1e-10)[0]
        return inertia, bend

    turn = np.array([1.0, *v(L, 1)])
    for i in range(4):
        for j in range(i + 1):
            inertia, bend = adaptive(i, j)
            tip = 0.4 * w(L)[i] * w(L)[j] + 0.02 * turn[i] * turn[j]
            hub = 0.7 * (i == j == 0)
            size = np.sqrt(model.mass[i, i] * model.mass[j, j])
            assert model.mass[i, j] == pytest.approx(inertia + tip + hub, abs=1e-12 * size)
            size = np.sqrt(model.stiffness[i, i] * model.stiffness[j, j])
            assert model.stiffness[i, j] == pytest.approx(bend, abs=1e-12 * size)


def test_rigid_inertia_is_the_textbook_one() -> None:
    """J = J_h + ∫m̄(r+x)² + m_t(r+L)² + J_t; a uniform beam gives m̄((r+L)³ − r³)/3."""
    arm = Arm(Beam(2.0, 3.0, 1.0), Hub(0.5, 0.25), Payload(0.7, 0.1))
    expected = 0.5 + 3.0 * (2.25**3 - 0.25**3) / 3 + 0.7 * 2.25**2 + 0.1
    for kind in KINDS:
        model = assemble(arm, kind(3))
        assert model.mass[0, 0] == pytest.approx(expected, rel=16 * EPS)
        assert model.mode_shapes[0, 0] == pytest.approx(expected**-0.5, rel=16 * EPS)


def test_mass_of_one_polynomial_is_the_integral_by_hand() -> None:
    """φ = ξ²/2: M_e = m̄L/20 + m_t/4 + J_t/L², Φ̃ = m̄(rL/6 + L²/8) + m_t(r+L)/2 + J_t/L."""
    m, EI, L, r, mt, jt = 3.0, 5.0, 2.0, 0.25, 0.7, 0.1
    model = assemble(Arm(Beam(L, m, EI), Hub(0.5, r), Payload(mt, jt)), Polynomial(2))
    M_e = m * L / 20 + mt / 4 + jt / L**2
    coupling = m * (r * L / 6 + L**2 / 8) + mt * (r + L) / 2 + jt / L
    assert model.mass[1, 1] == pytest.approx(M_e, rel=16 * EPS)
    assert model.mass[0, 1] == pytest.approx(coupling, rel=16 * EPS)
    assert_allclose(model.stiffness[1:, 1:], EI / L**3 * np.eye(2), rtol=16 * EPS, atol=16 * EPS)


@every_kind
@pytest.mark.parametrize(
    ("spec", "function"),
    [
        ((1.0, 0.0, 0.0, -5 / 6), lambda x: 1 - 5 / 6 * (x / 2) ** 3),
        (3.0, lambda x: 3.0),
        ((1.0, 0.5), lambda x: 1 + x / 4),
    ],
)
def test_callable_profile_gives_what_the_polynomial_gives(
    kind: type[Basis], spec: object, function: Callable[[np.ndarray], np.ndarray]
) -> None:
    exact = assemble(Arm(Beam(2.0, spec, spec)), kind(6))
    sampled = assemble(Arm(Beam(2.0, function, function)), kind(6))
    assert exact.quadrature_error <= EPS
    assert sampled.quadrature_error <= 1e-12
    for name in ("mass", "stiffness"):
        a, b = getattr(exact, name), getattr(sampled, name)
        size = np.sqrt(np.outer(np.diag(a), np.diag(a)))
        # The reported error, and the rounding of some hundred weighted terms.
        assert np.all(np.abs(a - b) <= (sampled.quadrature_error + 100 * EPS) * size)


def test_smooth_callable_reports_an_error_that_holds() -> None:
    """m̄ = exp(−x): J = ∫x² exp(−x) = 2 − 5/e, in closed form."""
    model = assemble(Arm(Beam(1.0, lambda x: np.exp(-x), 1.0)), Slewing(3))
    assert model.mass[0, 0] == pytest.approx(2 - 5 / np.e, rel=model.quadrature_error + 20 * EPS)


@pytest.mark.parametrize("at", [0.3, 0.7123])
@every_kind
def test_callable_with_a_step_is_refused_or_states_its_error(kind: type[Basis], at: float) -> None:
    """Nine halvings leave a step with an error of about 1e-3; Stations make it exact."""
    stepped = Arm(Beam(1.0, lambda x: np.where(x < at, 2.0, 1.0), 1.0))
    with pytest.raises(AccuracyError, match="Stations"):
        assemble(stepped, kind(3))


def test_callable_with_a_step_at_a_panel_edge_equals_the_table() -> None:
    """Halving meets 0.5 at once, and the rule has no point on the step itself."""
    table = Stations((0, 0.5, 0.5, 1), (2, 2, 1, 1))
    exact = assemble(Arm(Beam(1.0, table, 1.0)), Slewing(4))
    sampled = assemble(Arm(Beam(1.0, lambda x: np.where(x < 0.5, 2.0, 1.0), 1.0)), Slewing(4))
    assert_allclose(sampled.omega, exact.omega, rtol=1e-12)


def test_step_makes_the_mass_of_both_halves() -> None:
    """A step at 0.4 L: J = 2·0.4³/3 + (1 − 0.4³)/3 whatever the basis."""
    table = Stations((0, 0.4, 0.4, 1), (2, 2, 1, 1))
    expected = (2 * 0.4**3 + 1 - 0.4**3) / 3
    for kind in KINDS:
        mass = assemble(Arm(Beam(1.0, table, 1.0)), kind(4)).mass
        assert mass[0, 0] == pytest.approx(expected, rel=16 * EPS)


@every_kind
def test_energy_is_constant_without_torque_and_damping(kind: type[Basis], full_arm: Arm) -> None:
    """½ẋᵀMẋ + ½xᵀKx along exp(At), A = [[0, I], [−M⁻¹K, 0]] from M and K alone."""
    arm = Arm(full_arm.beam, Hub(0.7, 0.12), full_arm.payload)
    model = assemble(arm, kind(4))
    M, K = model.mass, model.stiffness
    assert_array_equal(model.damping, 0)
    A = np.block([[np.zeros((5, 5)), np.eye(5)], [-np.linalg.solve(M, K), np.zeros((5, 5))]])
    state = np.array([0.1, 1e-2, -2e-3, 1e-3, 5e-4, 0.3, 0.2, 0.1, -0.1, 0.05])

    def energy(z: np.ndarray) -> float:
        return float(z[5:] @ M @ z[5:] + z[:5] @ K @ z[:5]) / 2

    start = energy(state)
    # expm's error: ε times the growth ‖At‖ ~ ω t of rounded phases and cond(U) of A.
    for time in (0.03, 0.1, 0.5):
        allowed = 100 * EPS * (1 + model.omega[-1] * time) * np.linalg.cond(M)
        assert energy(expm(A * time) @ state) == pytest.approx(start, rel=allowed)


def test_displacement_is_rigid_rotation_plus_deflection(full_arm: Arm) -> None:
    model = assemble(full_arm, Slewing(3))
    rows = model.displacement(np.array([0.0, 0.65, 1.3]))
    assert_array_equal(rows[:, 0], 0.12 + np.array([0.0, 0.65, 1.3]))
    assert_allclose(rows[0, 1:], 0, atol=EPS)
    assert_allclose(rows[2, 1:], 1, atol=8 * EPS)  # unit tip displacement of the slewing set


def test_mode_shapes_deflect_the_tip_positively(full_arm: Arm) -> None:
    for kind in KINDS:
        model = assemble(full_arm, kind(5))
        tip = model.basis.evaluate(np.ones(1))[0] @ model.mode_shapes[1:, 1:]
        assert np.all(tip > 0)


def test_model_cannot_be_changed(full_arm: Arm) -> None:
    model: Model = assemble(full_arm, Slewing(2))
    for name in ("mass", "damping", "stiffness", "input", "omega", "mode_shapes"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(model, name)[0] = 1.0
    with pytest.raises(AttributeError):
        model.mass = np.eye(3)


@pytest.mark.parametrize("pair", [("arm", Slewing(2)), (Arm(Beam(1, 1, 1)), 3)])
def test_assemble_refuses_what_is_no_arm_or_basis(pair: tuple) -> None:
    with pytest.raises(InputError, match=r"assemble: .*(slewctl\.Arm|Slewing)"):
        assemble(*pair)


def test_breakpoints_that_differ_by_rounding_are_one() -> None:
    """0.3 and 0.1 + 0.2 are the same station to anyone but a computer."""
    mass = Stations((0, 0.3, 0.3, 1), (2, 2, 1, 1))
    stiffness = Stations((0, 0.1 + 0.2, 0.1 + 0.2, 1), (2, 2, 1, 1))
    expected = truth(Arm(Beam(1.0, mass, mass)), 4)
    assert_allclose(truth(Arm(Beam(1.0, mass, stiffness)), 4).omega, expected.omega, rtol=1e-12)
