"""The damping matrix: what it dissipates, and what each law gives every mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from strategies import arms, deterministic

from slewctl.arm import Arm, Beam, Hub, KelvinVoigt, Motor, Payload, Rayleigh
from slewctl.basis import Basis, ClampedFree, Polynomial, Slewing
from slewctl.model import Model, assemble, truth
from slewctl.plant import state_space

EPS = np.finfo(float).eps
kinds = st.sampled_from([ClampedFree, Slewing, Polynomial])
coefficients = st.one_of(st.just(0.0), st.floats(1e-6, 1.0))
laws = st.one_of(
    st.none(),
    st.builds(Rayleigh, coefficients, coefficients),
    st.builds(KelvinVoigt, coefficients),
)
ratios = st.one_of(st.floats(0, 0.5), st.lists(st.floats(0, 0.5), min_size=1, max_size=4))


@st.composite
def damped_arms(draw: st.DrawFn) -> Arm:
    """Any arm with every kind of damping, or none of some."""
    arm = draw(arms(damping=True))
    return replace(arm, damping_ratio=draw(ratios), damping=draw(laws))


@given(damped_arms(), kinds, st.integers(1, 8))
@deterministic(60)
def test_damping_never_adds_energy(arm: Arm, kind: type[Basis], n: int) -> None:
    """D is symmetric and semidefinite: scaled to a unit diagonal, no eigenvalue below −nε.

    A product of two rows of a factor carries (rows)·ε; there are fewer than 64 rows here.
    """
    D = assemble(arm, kind(n)).damping
    size = np.sqrt(np.diag(D))
    assert np.all(np.abs(D - D.T) <= n * EPS * np.outer(size, size))
    used = size > 0
    assert_array_equal(D[~used], 0)
    scaled = D[np.ix_(used, used)] / np.outer(size[used], size[used])
    if used.any():
        assert np.linalg.eigvalsh(scaled)[0] >= -64 * (n + 1) * EPS


@given(damped_arms(), kinds, st.integers(1, 6), st.integers(0, 2**32 - 1))
@deterministic(40)
def test_energy_falls_by_the_dissipated_power(
    arm: Arm, kind: type[Basis], n: int, seed: int
) -> None:
    """d/dt(½ẋᵀMẋ + ½xᵀKx) = −ẋᵀDẋ ≤ 0 along the free motion of the state-space model."""
    model = assemble(arm, kind(n))
    x, rate = np.random.default_rng(seed).normal(size=(2, n + 1))
    plant = state_space(model, "theta")
    acceleration = (np.asarray(plant.A) @ np.concatenate([x, rate]))[n + 1 :]
    power = rate @ model.mass @ acceleration + rate @ model.stiffness @ x
    dissipated = rate @ model.damping @ rate
    force = np.abs(model.stiffness) @ np.abs(x) + np.abs(model.damping) @ np.abs(rate)
    # UUᵀ stands for M⁻¹: its error is ε·cond(M), amplified by M.
    tolerance = 16 * (n + 1) * EPS * np.linalg.cond(model.mass) * (np.abs(rate) @ force)
    assert abs(power + dissipated) <= tolerance
    assert dissipated >= 0


@given(arms(), kinds, st.integers(1, 10), st.floats(0, 5), st.floats(0, 0.1))
@deterministic(60)
def test_rayleigh_gives_every_mode_alpha_plus_beta_omega_squared(
    arm: Arm, kind: type[Basis], n: int, alpha: float, beta: float
) -> None:
    """UᵀDU = diag(α, α + βω²): the rounding is that of UᵀMU and UᵀKU."""
    model = assemble(replace(arm, damping=Rayleigh(alpha, beta)), kind(n))
    U, rates = model.mode_shapes, np.array([0, *model.omega])
    mass = np.abs(U.T) @ np.abs(model.mass) @ np.abs(U) + rates[-1] / rates[1]
    condition = np.sqrt(np.linalg.cond(model.stiffness[1:, 1:]))
    stiffness = np.abs(U.T) @ np.abs(model.stiffness) @ np.abs(U)
    stiffness += condition * np.outer(rates, rates)
    error = np.abs(U.T @ model.damping @ U - np.diag(alpha + beta * rates**2))
    assert np.all(error <= 8 * (n + 1) * EPS * (alpha * mass + beta * stiffness))


def modal_damping(model: Model) -> np.ndarray:
    """UᵀDU, whose diagonal is 2ζω of every mode."""
    return model.mode_shapes.T @ model.damping @ model.mode_shapes


# In its own modes the truth's M and K are diagonal: rounding is relative to the entries.
TRUTH_ROUNDING = 200 * EPS


@pytest.mark.parametrize("law", [Rayleigh(0.3, 1e-4), Rayleigh(0.3), KelvinVoigt(1e-4)])
def test_truth_has_the_same_law(law: Rayleigh | KelvinVoigt, full_arm: Arm) -> None:
    """2ζω = α + βω² on every mode of the truth, beside its modal 2ζω and the friction."""
    model = truth(replace(full_arm, damping=law), 12)
    alpha, beta = law.coefficients
    rates = np.array([0, *model.omega])
    friction = full_arm.hub.friction * np.outer(model.mode_shapes[0], model.mode_shapes[0])
    expected = np.diag(alpha + beta * rates**2 + 2 * 0.01 * rates)
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected))) + expected.max() * EPS
    spread = model.omega[-1] / model.omega[0]
    error = np.abs(modal_damping(model) - expected - friction)
    assert np.all(error <= TRUTH_ROUNDING * spread * (size + np.abs(friction)))


def test_poles_of_a_kelvin_voigt_arm_are_those_of_its_modes() -> None:
    """s² + ηω²s + ω² = 0: damped oscillations below ω = 2/η, two real poles above."""
    arm = Arm(Beam(1.0, 3.0, 5.0), Hub(0.4, 0.2), damping=KelvinVoigt(2e-3))
    model = truth(arm, 12)
    assert model.omega[0] < 2 / 2e-3 < model.omega[-1]
    expected = [np.roots([1, 2e-3 * w**2, w**2]) for w in model.omega]
    poles = state_space(model, coordinates="modal").poles()
    flexible = np.sort_complex(poles[np.abs(poles) > 1e-3 * model.omega[0]])
    assert len(flexible) == 2 * 12
    size = 2e-3 * model.omega[-1] ** 2
    tolerance = TRUTH_ROUNDING * size * (model.omega[-1] / model.omega[0])
    assert_allclose(flexible, np.sort_complex(np.concatenate(expected)), rtol=0, atol=tolerance)


def test_one_kelvin_voigt_arm_is_the_arm_of_its_modal_ratios(full_arm: Arm) -> None:
    """ζ = ηω/2 mode by mode is the same matrix, friction and all."""
    eta = 1e-4
    by_law = truth(replace(full_arm, damping_ratio=0, damping=KelvinVoigt(eta)), 8)
    ratios = tuple(eta * by_law.omega / 2)
    by_ratio = truth(replace(full_arm, damping_ratio=ratios), 8)
    size = np.sqrt(np.outer(np.diag(by_law.damping), np.diag(by_law.damping)))
    spread = by_law.omega[-1] / by_law.omega[0]
    error = np.abs(by_law.damping - by_ratio.damping)
    assert np.all(error <= TRUTH_ROUNDING * spread * size)


@pytest.mark.parametrize("modes", [2, 6])
def test_ratios_belong_to_the_first_modes_whatever_their_number(modes: int) -> None:
    arm = Arm(Beam(1.0, 3.0, 5.0), Hub(0.4), damping_ratio=(0.01, 0.05, 0.002))
    zeta = np.array([0.01, 0.05, 0.002, 0.002, 0.002, 0.002])[:modes]
    for model in (truth(arm, modes), assemble(arm, ClampedFree(modes))):
        damping = modal_damping(model)
        expected = np.diag([0, *(2 * zeta * model.omega)])
        tolerance = TRUTH_ROUNDING * model.omega[-1]
        assert_allclose(damping, expected, rtol=0, atol=tolerance)


@given(arms(damping=True), kinds, coefficients, coefficients)
@deterministic(30)
def test_all_kinds_of_damping_add_up(
    arm: Arm, kind: type[Basis], alpha: float, beta: float
) -> None:
    law = Rayleigh(alpha, beta)
    alone = replace(arm, damping_ratio=0, hub=replace(arm.hub, friction=0))
    parts = [
        replace(alone, damping_ratio=arm.damping_ratio),
        replace(alone, damping=law),
        replace(alone, hub=arm.hub),
    ]
    total = assemble(replace(arm, damping=law), kind(4)).damping
    assert_allclose(
        total, sum(assemble(part, kind(4)).damping for part in parts), rtol=4 * EPS, atol=0
    )


@pytest.mark.parametrize("law", [Rayleigh(), Rayleigh(0, 0), KelvinVoigt(0)])
def test_law_of_nothing_changes_nothing(law: Rayleigh | KelvinVoigt, full_arm: Arm) -> None:
    plain, damped = (assemble(replace(full_arm, damping=d), Slewing(4)) for d in (None, law))
    for name in ("mass", "damping", "stiffness", "omega"):
        assert_array_equal(getattr(damped, name), getattr(plain, name))


def test_mass_proportional_drag_brakes_the_rigid_rotation_and_stiffness_does_not() -> None:
    arm = Arm(Beam(1.0, 3.0, 5.0), Hub(0.4, 0.2), Payload(0.3))
    drag = assemble(replace(arm, damping=Rayleigh(0.7)), Slewing(3))
    assert_array_equal(drag.damping, 0.7 * drag.mass)
    inner = assemble(replace(arm, damping=KelvinVoigt(0.7)), Slewing(3))
    assert_array_equal(inner.damping, 0.7 * inner.stiffness)
    assert_array_equal(inner.damping[0], 0)
    rigid = np.sort(np.abs(state_space(drag, "theta", coordinates="modal").poles().real))[:2]
    assert_allclose(rigid, [0, 0.35], atol=1e-9)  # modes: α/2; the rotation: 0 and α


def test_kelvin_voigt_power_is_that_of_the_strain_rate(full_arm: Arm) -> None:
    """∫ EI η v̇''² dx by QUADPACK, EI = 40 − 25(x/L)² and L = 1.3 m."""
    eta, basis, rates = 2e-3, ClampedFree(3), np.array([0.4, 1.0, -0.5, 0.2])
    arm = replace(full_arm, damping_ratio=0, hub=Hub(0.7, 0.12), damping=KelvinVoigt(eta))
    D = assemble(arm, basis).damping

    def loss(x: float) -> float:
        curvature = basis.evaluate(np.array([x / 1.3]), 2)[0] @ rates[1:] / 1.3**2
        return eta * (40.0 - 25.0 * (x / 1.3) ** 2) * float(curvature) ** 2

    expected = quad(loss, 0, 1.3, epsabs=0, epsrel=1e-12)[0]
    assert rates @ D @ rates == pytest.approx(expected, rel=1e-11)


def test_rotor_is_inertia_of_the_hub(full_arm: Arm) -> None:
    """The same M, D, K and modes as an arm whose hub holds the reflected inertia."""
    motor = Motor(2.6, 7.68e-3, 7.68e-3, 70.0, 0.9, 0.69, rotor_inertia=1e-4)
    hub = replace(full_arm.hub, inertia=full_arm.hub.inertia + 0.9 * 70.0**2 * 1e-4)
    ours = truth(replace(full_arm, motor=motor), 6)
    expected = truth(replace(full_arm, hub=hub), 6)
    assert_allclose(ours.omega, expected.omega, rtol=1e-12)
    for name in ("mass", "damping", "stiffness"):
        value = getattr(expected, name)
        assert_allclose(getattr(ours, name), value, rtol=0, atol=1e-11 * np.abs(value).max())
