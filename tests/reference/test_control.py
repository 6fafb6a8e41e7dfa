"""Published figures of control design and of margins, with their sources."""

from __future__ import annotations

import control
import numpy as np
import pytest

from slewctl import GeneralisedPlant, h2_lmi, lqg
from slewctl.linalg import solve_riccati
from slewctl.loop import classical_margins


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
