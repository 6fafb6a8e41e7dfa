"""Published figures of control design and of margins, with their sources."""

from __future__ import annotations

import control
import numpy as np
import pytest

from slewctl import GeneralisedPlant, h2_lmi, lqg, lqr
from slewctl.loop import classical_margins
from slewctl.numerics.matrix_equations import solve_riccati


def test_quanser_rotary_flexible_link_lqr() -> None:
    """LQR of Quanser's rotary flexible link, lumped one-mode model, voltage input.

    Quanser Inc., Rotary Flexible Link workbook: states [θ, α, θ̇, α̇],
    Q = diag(160, 60, 0.25, 1), R = 1.
    """
    resistance, torque_constant, back_emf, gear = 2.6, 7.68e-3, 7.68e-3, 70.0
    gearbox, motor = 0.9, 0.69
    friction, servo = 0.015, 0.00208
    link = 0.065 * 0.381**2 / 3  # the free length
    stiffness = (2 * np.pi * 3.0) ** 2 * link
    volt = gearbox * gear * motor * torque_constant / resistance  # N·m per V
    drag = friction + volt * gear * back_emf
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2] = [0, stiffness / servo, -drag / servo, 0]
    A[3] = [0, -stiffness * (link + servo) / (link * servo), drag / servo, 0]
    B = np.array([[0], [0], [volt / servo], [-volt / servo]])
    gain = solve_riccati(A, B, np.diag([160.0, 60.0, 0.25, 1.0]), np.eye(1)).gain
    # Printed to five figures: half a unit in the last one.
    np.testing.assert_allclose(gain[0, :2], [12.649, -13.441], atol=5e-4)
    np.testing.assert_allclose(gain[0, 2], 0.97799, atol=5e-6)
    np.testing.assert_allclose(gain[0, 3], 0.043846, atol=5e-7)


def test_classical_margins_of_the_disk_margin_tutorial() -> None:
    """Seiler, Packard, Gahinet, "An introduction to disk margins", IEEE CSM 40(5), 2020.

    L = 25/(s³ + 10s² + 10s + 10).  Routh's criterion gives (100 − 10)/25 = 3.6 exactly.
    """
    s = control.tf("s")
    margins = classical_margins(control.ss(25 / (s**3 + 10 * s**2 + 10 * s + 10)))
    assert 10 ** (margins.gain_db.value / 20) == pytest.approx(3.6, rel=1e-12)
    assert margins.gain_db.frequency_hz == pytest.approx(np.sqrt(10) / (2 * np.pi), rel=1e-12)
    assert round(margins.phase_deg.value, 2) == 29.11
    assert margins.confirmed


def zhou_doyle_glover_plant() -> GeneralisedPlant:
    B1 = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    B2 = np.ones((3, 1))
    system = control.StateSpace(
        [[-1, 0, 4], [0, 2, 0], [0, 0, -3]],
        np.hstack([B1, B2]),
        np.vstack([B1.T, B2.T]),
        [[0, 0, 0], [0, 0, 1], [0, 1, 0]],
        inputs=["w1", "w2", "torque"],
        outputs=["z1", "z2", "theta"],
    )
    return GeneralisedPlant(system, ("theta",))


def test_h2_optimum_of_an_unstable_plant() -> None:
    """Zhou, Doyle, Glover, Robust and Optimal Control, example 19.1; figures of h2syn.

    The optimal norm 8.9582 and the controller's gains ∓4.2361 are those printed in the
    tests of RobustAndOptimalControl.jl (test_h2_design.jl).
    """
    controller = lqg(zhou_doyle_glover_plant())
    assert controller.certificate.verified
    assert np.sqrt(controller.h2_cost) == pytest.approx(8.9582, abs=5e-5)
    # Only the mode at s = 2 is moved, to its mirror image: 2 − g = −√5, g = 2 + √5.
    golden = 2 + np.sqrt(5)
    np.testing.assert_allclose(controller.gains["state_feedback"], [[0, golden, 0]], atol=1e-12)
    np.testing.assert_allclose(controller.gains["observer"].T, [[0, golden, 0]], atol=1e-12)


@pytest.mark.parametrize("formulation", ["separated", "joint"])
@pytest.mark.parametrize("turned", [False, True])
def test_h2_optimum_by_matrix_inequalities(formulation: str, turned: bool) -> None:
    """The same example, as it stands and in other coordinates, by each formulation."""
    plant = zhou_doyle_glover_plant()
    T = np.array([[1.0, 2.0, 0.0], [-0.5, 1.0, 3.0], [0.0, 1.0, 1.0]]) if turned else np.eye(3)
    controller = h2_lmi(plant.transformed(T), formulation=formulation)
    assert controller.certificate.verified, controller.certificate
    assert np.sqrt(controller.h2_cost) == pytest.approx(8.9582, abs=5e-5)
    gains = controller.gains["state_feedback"] @ T
    np.testing.assert_allclose(gains, [[0, 2 + np.sqrt(5), 0]], atol=1e-3)


@pytest.mark.parametrize("epsilon", [1e-7, 1e-8, 1e-9, 1e-10])
def test_stiff_servo_of_the_riccati_benchmark_collection(epsilon: float) -> None:
    """Abels and Benner, CAREX, SLICOT Working Note 1999-14, example 2.7 (a magnetic tape drive).

    As ε → 0 two poles go to infinity and the gain to a limit; no mode is hidden on the way.
    """
    fast = 1 / epsilon
    A = np.array(
        [[0, 0.4, 0, 0], [0, 0, 0.345, 0],
         [0, -0.524 * fast, -0.465 * fast, 0.262 * fast], [0, 0, 0, -fast]]
    )  # fmt: skip
    b = np.array([[0.0], [0], [0], [fast]])
    C, D = np.zeros((4, 4)), np.zeros((4, 3))
    C[0, 0], C[1, 2], C[3, 0] = 1, 1, 1
    D[2, 2], D[3, 1] = 1, 1
    system = control.StateSpace(A, np.hstack([b, 0 * b, b]), C, D,
                                inputs=["w", "n", "u"], outputs=["z1", "z2", "zu", "y"])  # fmt: skip
    plant = GeneralisedPlant(system, ("y",))
    limit = [[1, 0.86123441, 0.180359, 0.04618742]]
    # The gain differs from its limit by a few ε.
    np.testing.assert_allclose(lqr(plant).gain, limit, rtol=max(1e-7, 10 * epsilon))
    Q, R = np.diag([1.0, 0, 1, 0]), np.eye(1)
    np.testing.assert_allclose(lqr(plant, Q=Q, R=R).gain, limit, rtol=max(1e-7, 10 * epsilon))


def test_h2_optimum_with_cross_terms() -> None:
    """Scherer, Gahinet, Chilali, IEEE Trans. Automatic Control 42 (1997), example 7."""
    A = np.array([[0.0, 10, 2], [-1, 1, 0], [0, 2, -5]])
    B = np.array([[1.0, 0], [0, 1], [1, 0]])
    C = np.array([[0.0, 1, 0], [0, 0, 1], [0, 0, 0], [0, 1, 0]])
    D = np.array([[0.0, 0], [0, 0], [0, 1], [2, 0]])
    system = control.StateSpace(A, B, C, D, inputs=["w", "u"], outputs=["z0", "z1", "z2", "y"])
    plant = GeneralisedPlant(system, ("y",))
    for found in (lqg(plant), h2_lmi(plant), h2_lmi(plant, formulation="joint")):
        assert found.certificate.verified, found.certificate
        assert found.h2_cost**0.5 == pytest.approx(7.7483506, rel=5e-7)
