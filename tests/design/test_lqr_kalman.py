"""State feedback and its dual against python-control and against what theory says of them."""

from __future__ import annotations

from collections.abc import Callable

import control
import numpy as np
import pytest
from design_problems import (
    OBJECTIVES,
    TWO_SENSORS,
    arms,
    design_plant,
    transfer,
)
from hypothesis import given, settings

from slewctl import (
    Arm,
    Beam,
    ClampedFree,
    InputError,
    Objective,
    Slewing,
    assemble,
    generalised_plant,
    h2_lmi,
    kalman,
    lqg,
    lqr,
)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("modes", [1, 4, 8])
def test_lqr_is_that_of_python_control(objective: Objective, modes: int) -> None:
    plant = design_plant(modes, objective)
    Q, R = plant.C1.T @ plant.C1, plant.D12.T @ plant.D12
    theirs, X, _ = control.lqr(plant.A, plant.B2, Q, R, method="scipy")
    ours = lqr(plant)
    np.testing.assert_allclose(ours.gain, theirs, rtol=1e-7, atol=1e-9 * np.abs(theirs).max())
    assert np.linalg.norm(ours.X - X) < 1e-9 * np.linalg.norm(X)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("modes", [1, 4, 8])
def test_kalman_is_that_of_python_control(objective: Objective, modes: int) -> None:
    plant = design_plant(modes, objective)
    V, W = plant.B1 @ plant.B1.T, plant.D21 @ plant.D21.T
    eye = np.eye(len(plant.A))
    theirs, _, _ = control.lqe(plant.A, eye, plant.C2, V, W, method="scipy")
    ours = kalman(plant).gain
    assert np.linalg.norm(ours - theirs) < 1e-9 * np.linalg.norm(theirs)


@pytest.mark.slow
def test_cost_to_go_is_the_integral_of_z_squared() -> None:
    plant = design_plant(2)
    solution = lqr(plant)
    start = np.random.default_rng(0).standard_normal(len(plant.A))
    closed = control.StateSpace(
        plant.A - plant.B2 @ solution.gain,
        start[:, None],
        plant.C1 - plant.D12 @ solution.gain,
        np.zeros((plant.performance, 1)),
    )
    # The slowest closed-loop pole decays like e^(−0.1 t); e^(−0.2·300) is nothing.
    t = np.linspace(0, 300, 600_001)
    z = control.impulse_response(closed, t).outputs
    integral = np.trapezoid(np.sum(z.reshape(plant.performance, -1) ** 2, axis=0), t)
    # The trapezoidal rule with 5e-4 s steps and modes up to 60 rad/s: (ωh)²/12 = 8e-5.
    assert integral == pytest.approx(start @ solution.X @ start, rel=1e-4)


@given(arms())
@settings(deadline=None, max_examples=20, derandomize=True)
def test_symmetric_root_locus(arm: Arm) -> None:
    """Every regulator pole p solves G(−p)ᵀG(p) + D₁₂ᵀD₁₂ = 0 with G from torque to z."""
    plant = generalised_plant(assemble(arm, ClampedFree(3)), TWO_SENSORS)
    gain = lqr(plant).gain
    poles = np.linalg.eigvals(plant.A - plant.B2 @ gain)
    C = plant.C1[:-1]
    outputs = [f"z{i}" for i in range(len(C))]
    G = control.StateSpace(plant.A, plant.B2, C, np.zeros((len(C), 1)), outputs=outputs)
    product = np.sum(transfer(G, poles) * transfer(G, -poles), axis=(1, 2))
    price = float((plant.D12.T @ plant.D12)[0, 0])
    # A relative pole error ε‖A‖/|p| is amplified by the pole's distance to the open-loop pole,
    # that is by the logarithmic derivative of the product.
    step = 1e-6 * np.abs(poles)
    beside = np.sum(transfer(G, poles + step) * transfer(G, -poles - step), axis=(1, 2))
    slope = np.abs(beside / product - 1) / 1e-6
    rounding = 1e3 * np.finfo(float).eps * np.linalg.norm(plant.A, 2) / np.abs(poles)
    assert np.all(np.abs(product / price + 1) < rounding * np.maximum(slope, 1))


@given(arms())
@settings(deadline=None, max_examples=20, derandomize=True)
def test_return_difference_of_lqr_is_never_below_one(arm: Arm) -> None:
    """Kalman's inequality: |1 + K(jω − A)⁻¹B| >= 1, hence 60 degrees and 6 dB at the states."""
    plant = generalised_plant(assemble(arm, ClampedFree(3)), OBJECTIVES[0])
    gain = lqr(plant).gain
    loop = control.StateSpace(plant.A, plant.B2, gain, 0)
    poles = np.linalg.eigvals(plant.A - plant.B2 @ gain)
    omega = np.concatenate([np.geomspace(1e-2, 1e4, 500), np.abs(poles), np.abs(poles.imag)])
    omega = omega[omega > 0]
    # Equality holds in the limit of high frequency; rounding of one direct solve beside it.
    assert np.abs(1 + transfer(loop, 1j * omega)).min() > 1 - 1e-9


def test_filter_gain_is_the_state_feedback_of_the_transposed_plant() -> None:
    plant = design_plant(3)
    transposed = control.StateSpace(
        plant.A.T,
        np.hstack([np.zeros((len(plant.A), 1)), plant.C2.T]),
        np.vstack([plant.B1.T, np.zeros((1, len(plant.A)))]),
        np.vstack([np.hstack([np.zeros((2, 1)), plant.D21.T]), np.zeros((1, 2))]),
        inputs=["w", "torque"],
        outputs=["z1", "z2", "theta"],
    )
    dual = type(plant)(transposed, ("theta",))
    assert np.linalg.norm(lqr(dual).gain - kalman(plant).gain.T) < 1e-12 * np.linalg.norm(
        kalman(plant).gain
    )


@pytest.mark.parametrize("method", [lqr, kalman, lqg, h2_lmi])
def test_designing_on_something_else_is_refused(method: Callable[[object], object]) -> None:
    for wrong in (None, assemble(Arm(Beam(1.0, 1.0, 1.0)), Slewing(1))):
        with pytest.raises(InputError, match="is not a GeneralisedPlant"):
            method(wrong)
