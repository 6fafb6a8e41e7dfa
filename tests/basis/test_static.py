"""The static shape against beam theory in closed form, and the iteration made of such shapes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial as PowerSeries
from numpy.testing import assert_allclose

from slewctl import Arm, Beam, Hub, InputError, Payload, Stations, assemble, truth
from slewctl.basis import ArmMatched, ClampedFree, HubMatched, Polynomial, Slewing, WithStatic

EPS = np.finfo(float).eps
XI = np.linspace(0, 1, 101)
STEP = Stations((0.0, 0.4, 0.4, 1.0), (3.0, 3.0, 1.0, 1.0))
TAPER = (1.0, 0.0, 0.0, -5.0 / 6.0)
ARMS = {
    "uniform": Arm(Beam(1.0, 1.0, 1.0)),
    "taper": Arm(Beam(2.0, TAPER, TAPER), Hub(0.3, 0.2), Payload(0.1, 0.05)),
    "stepped": Arm(Beam(1.0, STEP, STEP), Hub(0.1, 0.1), Payload(0.4, 0.1)),
    "nearly pointed": Arm(Beam(1.0, (1.0, -0.999), (1.0, -0.999)), Hub(0.01)),
    "callable": Arm(Beam(1.0, 1.0, lambda x: 1 + 0.5 * np.sin(3 * x)), Hub(0.1)),
}
every_arm = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)


def moment(arm: Arm, x: np.ndarray) -> np.ndarray:
    """M(x) for constant angular acceleration, by Gauss quadrature from each x to the tip."""
    L, r = arm.beam.length, arm.hub.radius
    nodes, weights = np.polynomial.legendre.leggauss(12)
    found = arm.payload.mass * (r + L) * (L - x) + arm.payload.inertia
    for i, start in enumerate(x):
        cuts = np.array([start, *(L * b for b in arm.beam.breakpoints if L * b > start), L])
        half, middle = np.diff(cuts) / 2, (cuts[1:] + cuts[:-1]) / 2
        s = (middle[:, None] + half[:, None] * nodes).ravel()
        w = (half[:, None] * weights).ravel()
        found[i] += w @ (arm.beam.mass_profile(s / L) * (r + s) * (s - start))
    return found


@every_arm
def test_static_curvature_is_moment_over_stiffness(arm: Arm) -> None:
    """To 1e-12 of the largest, for the Legendre tail is cut at 5e-14 of the L2 norm, and to the
    rounding of the moment over EI, which counts at a pointed tip (at its end a Legendre
    polynomial of degree 40 is nine times its mean).
    """
    static = WithStatic(ClampedFree(1), arm).static
    away = np.array([xi for xi in XI if all(abs(xi - b) > 1e-9 for b in arm.beam.breakpoints)])
    bending, EI = moment(arm, arm.beam.length * away), arm.beam.stiffness_profile(away)
    expected = bending / EI
    computed = static.evaluate(away, 2)[:, 0]
    scale = (computed @ expected) / (expected @ expected)
    tolerance = 1e-12 * expected.max() + 32 * EPS * bending.max() / EI
    assert np.all(np.abs(computed / scale - expected) <= tolerance)


def test_static_shape_of_the_uniform_arm_is_the_textbook_polynomial() -> None:
    """φ ∝ 20ξ² − 10ξ³ + ξ⁵: a beam under the load q ∝ ξ (M = 1/3 − ξ/2 + ξ³/6)."""
    static = WithStatic(Slewing(1), ARMS["uniform"]).static
    expected = PowerSeries([0, 0, 20, -10, 0, 1.0])
    for derivative in range(3):
        exact = expected.deriv(derivative)(XI) if derivative else expected(XI)
        computed = static.evaluate(XI, derivative)[:, 0]
        scale = (computed @ exact) / (exact @ exact)
        assert_allclose(computed / scale, exact, rtol=0, atol=2e-13 * np.abs(exact).max())
    assert static.growth.degree == 5


@every_arm
@pytest.mark.parametrize("parent", [ClampedFree(2), Slewing(3), HubMatched(2)])
def test_the_model_bends_as_the_arm_under_a_slow_torque(arm: Arm, parent: object) -> None:
    """The flexibility Φ̃ K_e⁻¹ Φ̃ᵀ seen by the torque is that of the converged polynomials.

    The parent alone is less flexible, as every Ritz approximation.
    """

    def flexibility(basis: object) -> float:
        model = assemble(arm, basis)
        return float(
            model.mass[0, 1:] @ np.linalg.solve(model.stiffness[1:, 1:], model.mass[1:, 0])
        )

    # Panels towards the tip resolve the pointed beam, whose EI nearly vanishes there.
    edges = arm.beam.breakpoints or tuple(1 - 0.5 ** np.arange(1, 7))
    exact = flexibility(Polynomial(30 * (len(edges) + 1), edges))
    assert flexibility(WithStatic(parent)) == pytest.approx(exact, rel=1e-11)
    assert flexibility(parent) < exact * (1 - 1e-8)


def test_a_static_shape_that_adds_nothing_is_refused() -> None:
    """On a uniform arm it is a polynomial of degree 5, which Polynomial(4) contains."""
    arm = ARMS["uniform"]
    assert assemble(arm, WithStatic(Polynomial(3))).n == 4
    with pytest.raises(InputError, match="in the span"):
        assemble(arm, WithStatic(Polynomial(4)))
    with pytest.raises(InputError, match="in the span"):
        WithStatic(WithStatic(Slewing(2)), arm)


@pytest.mark.parametrize("inertia", [0.0, 1e-6, 1.0, 1e6, 1e12])
@pytest.mark.parametrize("parent", [ClampedFree(20), Slewing(20)])
def test_nearly_dependent_static_shapes_leave_the_model_sound(
    parent: object, inertia: float
) -> None:
    """With the static shape no frequency rises, and none falls below the exact one."""
    arm = Arm(Beam(1.0, (1.0, -0.5), (1.0, -0.5)), Hub(inertia), Payload(0.2))
    exact = truth(arm, 20)
    with_it, without = assemble(arm, WithStatic(parent)), assemble(arm, parent)
    assert np.all(with_it.omega[:20] <= without.omega * (1 + 1e-10))
    # Rounding of ω_k is about ε ω_n/ω_1 in a model of n functions.
    rounding = EPS * with_it.omega[-1] / with_it.omega[0] + exact.tolerance
    assert np.all(with_it.omega[:20] >= exact.omega * (1 - 4 * rounding))


@every_arm
@pytest.mark.parametrize("n", [1, 4, 12])
def test_arm_matched_functions_have_orthogonal_strain(arm: Arm, n: int) -> None:
    stiffness = assemble(arm, ArmMatched(n)).stiffness[1:, 1:]
    assert_allclose(stiffness / stiffness[0, 0], np.eye(n), rtol=0, atol=1e-11)


@every_arm
def test_each_step_brings_the_functions_nearer_to_the_modes(arm: Arm) -> None:
    """Frequencies fall with each step and by far; after twelve they are the exact ones."""
    exact = truth(arm, 4)
    errors = [assemble(arm, ArmMatched(4, steps)).omega / exact.omega - 1 for steps in (1, 2, 12)]
    floor = 1e-11
    assert np.all(errors[1] <= np.maximum(errors[0] / 2, floor))
    assert np.all(np.abs(errors[2]) <= [1e-11, 1e-11, 1e-11, 1e-7])


def test_the_arms_own_modes_are_a_basis_with_no_error_at_all() -> None:
    """``truth(arm, n).basis``: what arm-matched functions tend to."""
    arm = ARMS["taper"]
    modes = truth(arm, 4)
    model = assemble(arm, modes.basis)
    assert_allclose(model.omega, modes.omega, rtol=1e-12)
    assert_allclose(model.mode_shapes, modes.mode_shapes, rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("taper", [(1.0,), (1.0, -0.5), TAPER])
@pytest.mark.parametrize("hub", [0.0, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("payload", [0.0, 0.1, 10.0])
def test_four_arm_matched_functions_are_good_everywhere(
    taper: tuple[float, ...], hub: float, payload: float
) -> None:
    """Frequencies to 1e-6 and residues to 0.1 % for modes 1–3, whatever hub and payload."""
    mass = PowerSeries(taper)
    inertia = (mass * PowerSeries([0.0, 0.0, 1.0])).integ()(1.0)
    arm = Arm(
        Beam(1.0, taper, taper), Hub(hub * inertia), Payload(payload * float(mass.integ()(1.0)))
    )
    model, exact = assemble(arm, ArmMatched(4)), truth(arm, 8)
    assert_allclose(model.omega[:3], exact.omega[:3], rtol=1e-6)
    tip = np.ones(1)
    for found, true in zip(model.mode_shapes[0, 1:4], exact.mode_shapes[0, 1:4], strict=True):
        assert found**2 == pytest.approx(true**2, rel=1e-3)
    assert_allclose(
        (model.mode_shapes[0] * (model.displacement(tip) @ model.mode_shapes)[0])[1:4],
        (exact.mode_shapes[0] * (exact.displacement(tip) @ exact.mode_shapes)[0])[1:4],
        rtol=1e-3,
    )


@pytest.mark.parametrize("steps", [0, -1, 1.5, True])
def test_impossible_numbers_of_steps_are_refused(steps: object) -> None:
    with pytest.raises(InputError) as error:
        ArmMatched(2, steps)
    assert error.value.where == "ArmMatched.steps"


def test_what_is_no_arm_or_basis_is_refused() -> None:
    with pytest.raises(InputError, match="not an Arm"):
        ArmMatched(2, arm="arm")
    with pytest.raises(InputError):
        WithStatic(ARMS["uniform"], ClampedFree(2))
