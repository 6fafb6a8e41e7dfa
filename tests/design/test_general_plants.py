"""The H2 methods on plants that keep no convenience: cross terms, feedthrough, a clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import control
import numpy as np
import pytest
from design_problems import TWO_SENSORS, design_plant
from general_plants import Array, loop_cost, made, random_plant, seeds
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_are, solve_discrete_are
from scipy.optimize import minimize

from slewctl import Controller, DesignError, GeneralisedPlant, InputError, h2_lmi, kalman, lqg, lqr
from slewctl.design import METHODS, h2_estimator, h2_hinf, h2_region, h2_state_feedback

few = settings(deadline=None, max_examples=20, derandomize=True)
fewer = settings(deadline=None, max_examples=5, derandomize=True)
clocks = st.booleans()

# A double integrator with force noise, sampled at 0.1 s; and where one noise is all there is.
DOUBLE = (np.array([[1, 0.1], [0, 1]]), np.array([[0.005], [0.1]]))
SAMPLED = made(
    DOUBLE[0], np.hstack([DOUBLE[1], 0 * DOUBLE[1], DOUBLE[1]]), [[1, 0], [0, 0], [1, 0]],
    np.array([[0, 0, 0], [0, 0, 1], [0, 1, 0]]), 0.1,
)  # fmt: skip
ONE_NOISE = made(
    [[-0.1, 0], [-0.1, -0.01]], np.array([[0, 1], [1, 0]]), [[0, 1], [0, 0], [-0.1, 0]],
    np.array([[0, 0], [0, 1], [1, 0]]),
)  # fmt: skip


@given(seeds, clocks)
@few
def test_lqr_is_scipys_equation_with_a_cross_term(seed: int, sampled: bool) -> None:
    p = random_plant(seed, sampled=sampled)
    Q, R, S = p.C1.T @ p.C1, p.D12.T @ p.D12, p.C1.T @ p.D12
    if sampled:
        X = solve_discrete_are(p.A, p.B2, Q, R, s=S)
        K = np.linalg.solve(R + p.B2.T @ X @ p.B2, p.B2.T @ X @ p.A + S.T)
    else:
        X = solve_continuous_are(p.A, p.B2, Q, R, s=S)
        K = np.linalg.solve(R, p.B2.T @ X + S.T)
    np.testing.assert_allclose(lqr(p).gain, K, atol=1e-6 * np.abs(K).max())


@given(seeds, clocks, st.integers(1, 2))
@few
def test_kalman_is_scipys_equation_with_correlated_noise(
    seed: int, sampled: bool, sensors: int
) -> None:
    p = random_plant(seed, sampled=sampled, sensors=sensors)
    W, V, S = p.B1 @ p.B1.T, p.D21 @ p.D21.T, p.B1 @ p.D21.T
    if sampled:
        P = solve_discrete_are(p.A.T, p.C2.T, W, V, s=S)
        L = np.linalg.solve(V + p.C2 @ P @ p.C2.T, p.C2 @ P @ p.A.T + S.T)
    else:
        P = solve_continuous_are(p.A.T, p.C2.T, W, V, s=S)
        L = np.linalg.solve(V, p.C2 @ P + S.T)
    np.testing.assert_allclose(kalman(p).gain.T, L, atol=1e-6 * np.abs(L).max())


def test_lqr_of_a_sampled_plant_is_dlqr() -> None:
    K = lqr(SAMPLED, Q=np.diag([1.0, 0.0]), R=np.eye(1)).gain
    np.testing.assert_allclose(K, [[0.93174514, 1.36509717]], rtol=1e-8)


@given(seeds, clocks, st.integers(1, 2))
@few
def test_the_cost_is_that_of_the_loop_as_given(seed: int, sampled: bool, sensors: int) -> None:
    p = random_plant(seed, sampled=sampled, sensors=sensors)
    found = lqg(p)
    assert found.certificate.verified, found.certificate
    assert found.sample_time == p.sample_time
    assert found.h2_cost == pytest.approx(loop_cost(p, found.system), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("sampled", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_no_controller_of_a_first_order_plant_is_better(seed: int, sampled: bool) -> None:
    """All first-order controllers, searched without any theory: the optimum is among them."""
    p = random_plant(seed, sampled=sampled, states=1)
    best = lqg(p)
    k = best.system
    a, b1, b2, c1, c2 = p.A, p.B1, p.B2, p.C1, p.C2
    d22 = p.D22[0, 0]

    def cost(x: Array) -> float:
        """Of u = c x_k + d y, x_k' = a x_k + y, by the scalar of the loop without delay."""
        d = x[2] if sampled else 0.0
        solved = 1 / (1 - d * d22)
        u_x, u_k, u_w = d * solved * c2, np.array([[x[1] * solved]]), d * solved * p.D21
        y_x, y_k, y_w = c2 + d22 * u_x, d22 * u_k, p.D21 + d22 * u_w
        A = np.block([[a + b2 @ u_x, b2 @ u_k], [y_x, x[0] + y_k]])
        B = np.vstack([b1 + b2 @ u_w, y_w])
        C = np.hstack([c1 + p.D12 @ u_x, p.D12 @ u_k])
        D = p.D11 + p.D12 @ u_w
        poles = np.linalg.eigvals(A)
        if (np.abs(poles).max() >= 1) if sampled else (poles.real.max() >= 0):
            return 1e9
        eye = np.eye(2)
        operator = np.kron(A, A) - np.eye(4) if sampled else np.kron(A, eye) + np.kron(eye, A)
        P = np.linalg.solve(operator, -(B @ B.T).ravel()).reshape(2, 2)
        return float(np.trace(C @ P @ C.T) + np.sum(D**2))

    start = np.array([k.A[0, 0], (k.B @ k.C)[0, 0], k.D[0, 0]][: 3 if sampled else 2])
    assert cost(start) == pytest.approx(best.h2_cost, rel=1e-9)
    rng = np.random.default_rng(seed)
    least = min(
        minimize(
            cost,
            start + spread * (1 + np.abs(start)) * rng.normal(size=start.size),
            method="Nelder-Mead",
            options={"xatol": 1e-8, "fatol": 1e-12, "maxiter": 1000},
        ).fun
        for spread in (0.1, 0.3, 0.3, 1.0)
    )
    assert least == pytest.approx(best.h2_cost, rel=1e-7)


def test_one_noise_for_plant_and_sensor() -> None:
    """The estimate is then perfect: all of the loop's cost is the regulator's."""
    found = lqg(ONE_NOISE)
    assert found.certificate.verified
    assert found.h2_cost**0.5 == pytest.approx(2.092481, rel=1e-6)
    X = lqr(ONE_NOISE).X
    assert found.h2_cost == pytest.approx(float((ONE_NOISE.B1.T @ X @ ONE_NOISE.B1)[0, 0]))


@given(seeds, clocks)
@few
def test_order_and_mixing_of_w_and_z_do_not_matter(seed: int, sampled: bool) -> None:
    """White noise and a sum of squares know no axes: any rotation of w and of z is the same."""
    p = random_plant(seed, sampled=sampled)
    rng = np.random.default_rng(seed)
    before, after = (
        np.linalg.qr(rng.normal(size=(n, n)))[0] for n in (p.disturbances, p.performance)
    )
    B, C, D = (np.array(getattr(p.system, name)) for name in "BCD")
    B[:, :-1] = B[:, :-1] @ before
    D[:, :-1] = D[:, :-1] @ before
    C[:-1], D[:-1] = after @ C[:-1], after @ D[:-1]
    one, other = lqg(p), lqg(made(p.A, B, C, D, p.sample_time))
    assert other.h2_cost == pytest.approx(one.h2_cost, rel=1e-8)
    np.testing.assert_allclose(
        other.gains["state_feedback"], one.gains["state_feedback"], rtol=1e-5, atol=1e-7
    )


@given(seeds, clocks)
@few
def test_states_do_not_matter(seed: int, sampled: bool) -> None:
    p = random_plant(seed, sampled=sampled)
    rng = np.random.default_rng(seed)
    T = np.linalg.qr(rng.normal(size=(3, 3)))[0] * 10 ** rng.uniform(-1, 1, 3)
    one, other = lqg(p), lqg(p.transformed(T))
    assert other.h2_cost == pytest.approx(one.h2_cost, rel=1e-6)
    K = one.gains["state_feedback"]
    np.testing.assert_allclose(other.gains["state_feedback"] @ T, K, atol=1e-5 * np.abs(K).max())


@pytest.mark.parametrize("formulation", ["separated", "joint"])
@given(seeds)
@fewer
def test_inequalities_find_the_same_optimum(formulation: str, seed: int) -> None:
    p = random_plant(seed, states=2)
    found = h2_lmi(p, formulation=formulation)
    assert found.h2_cost == pytest.approx(lqg(p).h2_cost, rel=1e-6)
    assert loop_cost(p, found.system) == pytest.approx(found.h2_cost, rel=1e-9)


@given(seeds)
@fewer
def test_gains_by_inequalities_are_those_of_the_equations(seed: int) -> None:
    p = random_plant(seed, states=2, sensors=2)
    K, L = h2_state_feedback(p), h2_estimator(p)
    np.testing.assert_allclose(K.gain, lqr(p).gain, atol=1e-3 * np.abs(K.gain).max())
    np.testing.assert_allclose(L.gain, kalman(p).gain, atol=1e-3 * np.abs(L.gain).max())
    assert K.certificate.verified
    assert L.certificate.verified


@given(seeds)
@fewer
def test_constraints_that_bind_nothing_leave_the_optimum(seed: int) -> None:
    p = random_plant(seed, states=2)
    optimum = lqg(p).h2_cost
    wide = h2_region(p, radius_max=1e6)
    loose = h2_hinf(p, hinf_max=1e9, weight_hz=1.0)
    assert wide.h2_cost == pytest.approx(optimum, rel=1e-9)
    assert loose.h2_cost == pytest.approx(optimum, rel=1e-9)


@pytest.mark.slow
def test_a_bound_that_binds_is_kept_with_feedthrough() -> None:
    p = random_plant(3, states=2)
    free = h2_hinf(p, hinf_max=1e9, weight_hz=0.1)
    limit = 0.7 * free.guarantees[0].achieved
    found = h2_hinf(p, hinf_max=limit, weight_hz=0.1)
    k, omega = found.system, np.geomspace(1e-3, 1e3, 4000)
    s = 1j * omega
    K, G = k(s, squeeze=True), p.control_path(s, squeeze=True)
    spilled = np.abs(s / (s + 2 * np.pi * 0.1) * K / (1 - K * G))
    assert spilled.max() <= limit * (1 + 1e-6)
    assert spilled.max() > 0.9 * limit
    assert found.certificate.verified, found.certificate


OPTIONS: dict[str, dict[str, object]] = {
    "given": {"pid": {"kp": 1.0}},
    "h2-region": {"radius_max": 1e6},
    "h2-hinf": {"hinf_max": 1e9, "weight_hz": 1.0},
    "payload-lmi": {"payload_mass": [0.0, 0.1]},
    "variance-bound": {"std_max": {"torque": 1.0}},
    "pole-placement": {"bandwidth_hz": 1.0},
    "pd-notch": {"bandwidth_hz": 1.0},
    "positive-position": {"bandwidth_hz": 1.0},
    "lead": {"crossover_hz": 1.0},
}


def designed(name: str, plant: GeneralisedPlant) -> Controller:
    return METHODS[name](plant, **OPTIONS.get(name, {}))


@pytest.mark.parametrize("name", [name for name in METHODS if name != "lqg"])
def test_a_sampled_plant_is_refused_by_name(name: str) -> None:
    arm = design_plant(1)
    sampled = replace(arm, system=arm.system.sample(0.01))
    for plant in (SAMPLED, replace(sampled, system=_named(sampled.system, arm.system))):
        with pytest.raises(InputError, match="the plant is sampled, every 0"):
            designed(name, plant)


def _named(system: control.StateSpace, like: control.StateSpace) -> control.StateSpace:
    return control.StateSpace(
        system.A, system.B, system.C, system.D, system.dt,
        inputs=like.input_labels, outputs=like.output_labels,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["lqg", "h2-lmi", "h2-region", "h2-hinf", "variance-bound"])
def test_white_noise_that_passes_straight_to_z_is_refused_by_name(name: str) -> None:
    arm = design_plant(1)
    D = np.array(arm.system.D)
    D[0, 1] = 3.0
    system = control.StateSpace(arm.A, arm.system.B, arm.system.C, D,
                                inputs=arm.system.input_labels, outputs=arm.system.output_labels)  # fmt: skip
    with pytest.raises(DesignError, match="w_theta reaches z_tip without delay"):
        designed(name, replace(arm, system=system))


@pytest.mark.parametrize(
    "given", [{"sample_time": 0.1}, {"sample_time": 0.1, "delay": 0.1}, {"integral_limit": 1.0}]
)
def test_options_without_meaning_for_a_sampled_plant_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(InputError, match="sampled already"):
        lqg(SAMPLED, **given)


@pytest.mark.parametrize("feedthrough", [-0.4, 0.3])
@pytest.mark.parametrize(
    "design",
    [
        lqg,
        lambda p: lqg(p, integral_limit=0.5),
        h2_lmi,
        lambda p: designed("pole-placement", p),
        lambda p: designed("pd-notch", p),
    ],
)
def test_the_verdict_is_that_of_the_loop_with_feedthrough(
    design: Callable[[GeneralisedPlant], Controller], feedthrough: float
) -> None:
    """An arm whose angle sensor reads the actuator: the loop is python-control's own."""
    arm = design_plant(1, TWO_SENSORS)
    D = np.array(arm.system.D)
    D[arm.performance :, -1] = feedthrough
    system = control.StateSpace(arm.A, arm.system.B, arm.system.C, D,
                                inputs=arm.system.input_labels, outputs=arm.system.output_labels)  # fmt: skip
    p = replace(arm, system=system)
    found = design(p)
    k = found.system
    poles = p.system.lft(control.ss(k.A, k.B, k.C, k.D), 1, 2).poles()
    assert (poles.real.max() < 0) == (found.poles.real.max() < 0)
    assert found.certificate.verified == (poles.real.max() < 0)
    np.testing.assert_allclose(np.sort(np.abs(found.poles)), np.sort(np.abs(poles)), rtol=1e-5)


def test_words_are_of_the_plant_at_hand() -> None:
    """No arm, no torque, no limits in what is said of a plant that has none."""
    base = random_plant(1)
    A = np.zeros((4, 4))
    A[:3, :3] = base.A
    B = np.vstack([base.system.B, [[1.0, 0, 0, 0]]])
    C = np.hstack([base.system.C, [[0.0], [0], [0], [0]]])
    hidden = C.copy()
    hidden[3, 3] = 1.0
    for outputs, message in ((C, "is not penalised"), (hidden, "is not penalised")):
        with pytest.raises(DesignError, match=f"the pole at 0 rad/s {message}") as caught:
            lqg(made(A, B, outputs, base.system.D))
        assert "limits" not in caught.value.remedy
    seen = hidden.copy()
    seen[0, 3] = 1.0
    with pytest.raises(DesignError, match="the pole at 0 rad/s is not reached by the u"):
        lqg(made(A, B, seen, base.system.D))


def test_an_undamped_mode_that_nothing_excites_is_named() -> None:
    A = np.array([[0.0, 1], [-4, 0]])
    B = np.array([[0.0, 0, 0], [0, 0, 1]])
    p = made(A, B, [[1, 0], [0, 0], [1, 0]], np.array([[0, 0, 0], [0, 0, 1], [0, 1.0, 0]]))
    with pytest.raises(DesignError, match=r"the mode at 0.3183 Hz is not excited"):
        lqg(p)
