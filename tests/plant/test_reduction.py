"""Reductions: what is kept is exact, what is lost is bounded, and units do not matter."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import solve_continuous_lyapunov
from strategies import arms, deterministic

from slewctl import (
    Arm,
    Beam,
    GeneralisedPlant,
    Hub,
    InputError,
    KelvinVoigt,
    Objective,
    generalised_plant,
    lqg,
    truth,
)
from slewctl.loop import peak_gain
from slewctl.plant import Reduced, balanced_truncation, modal_truncation, state_space
from slewctl.plant.separation import separate

OBJECTIVE = Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 1e-2, "tip": 1e-2})


def arm_with(ratio: float = 0.005, friction: float = 0.0) -> Arm:
    return Arm(Beam(1.0, (1.0, -0.4), 1.0), Hub(0.1, 0.05, friction), damping_ratio=ratio)


def plant_of(arm: Arm, modes: int = 12) -> GeneralisedPlant:
    return generalised_plant(truth(arm, modes), OBJECTIVE)


def without(system: control.StateSpace, states: list[int]) -> control.StateSpace:
    """The system without some uncoupled states."""
    A = np.delete(np.delete(system.A, states, 0), states, 1)
    return control.StateSpace(
        A, np.delete(system.B, states, 0), np.delete(system.C, states, 1), system.D
    )


def flexible_error(system: control.StateSpace, reduced: Reduced, modes: int) -> control.StateSpace:
    """G − Gr without the rigid body, of an arm without friction in modal coordinates."""
    G, Gr = without(system, [0, modes + 1]), without(reduced.system, [0, 1])
    return control.StateSpace(
        np.block(
            [[G.A, np.zeros((G.nstates, Gr.nstates))], [np.zeros((Gr.nstates, G.nstates)), Gr.A]]
        ),
        np.vstack([G.B, Gr.B]),
        np.hstack([G.C, -Gr.C]),
        G.D - Gr.D,
    )


def response(system: control.StateSpace, omega: float) -> np.ndarray:
    A = np.asarray(system.A)
    return system.C @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, system.B) + system.D


@deterministic(40)
@given(
    arm=arms(),
    ratio=st.sampled_from([1e-4, 1e-3, 0.02, 0.3]),
    order=st.integers(2, 13),
    output=st.sampled_from(["theta", "tip", "theta_dot", "tip_acceleration"]),
)
def test_balanced_error_is_between_its_bounds(
    arm: Arm, ratio: float, order: int, output: str
) -> None:
    """σ_k+1 <= ‖G − Gr‖∞ <= 2 Σ σ, with the norm from level sets in the loop room."""
    system = state_space(truth(replace(arm, damping_ratio=ratio), 8), [output], coordinates="modal")
    reduced = balanced_truncation(system, order)
    peak = peak_gain(flexible_error(system, reduced, 8)).value
    assert reduced.hankel[order - 2] * (1 - 1e-6) <= peak <= reduced.bound * (1 + 1e-6)
    assert reduced.error <= peak * (1 + 1e-6)
    assert_allclose(reduced.bound, 2 * reduced.hankel[order - 2 :].sum(), rtol=1e-14)


@pytest.mark.parametrize("correction", [False, True])
@pytest.mark.parametrize("output", ["theta", "tip", "theta_dot", "tip_acceleration"])
@pytest.mark.parametrize("ratio", [1e-4, 0.02])
def test_modal_error_is_below_its_bound(output: str, correction: bool, ratio: float) -> None:
    system = state_space(truth(arm_with(ratio), 10), [output], coordinates="modal")
    reduced = modal_truncation(system, 3, correction)
    peak = peak_gain(flexible_error(system, reduced, 10)).value
    assert reduced.error <= peak * (1 + 1e-7)
    # Nehari: no constant beside a system brings its norm below its largest Hankel value.
    assert reduced.hankel[0] * (1 - 1e-7) <= peak <= reduced.bound * (1 + 1e-7)


@pytest.mark.parametrize("ratio", [1e-6, 1e-4, 0.05, 0.7])
def test_hankel_values_of_one_mode_in_closed_form(ratio: float) -> None:
    """k/(s² + as + ω²): σ₁σ₂ = k²/(2aω)² and σ₁ − σ₂ = k/(2ω²)."""
    k, omega = 3.0, 5.0
    a = 2 * ratio * omega
    system = control.StateSpace([[0, 1], [-(omega**2), -a]], [[0], [1]], [[k, 0]], 0)
    hankel = balanced_truncation(system, 1).hankel
    assert_allclose(hankel.prod(), (k / (2 * a * omega)) ** 2, rtol=1e-9)
    assert_allclose(hankel[0] - hankel[1], k / (2 * omega**2), rtol=1e-9 / ratio)


def test_hankel_values_agree_with_lyapunov_equations() -> None:
    """Another way to them: √eig(PW) with scipy's Gramians of the flexible states."""
    system = state_space(truth(arm_with(0.02), 6), ["theta", "tip"], coordinates="modal")
    flexible = without(system, [0, 7])
    P = solve_continuous_lyapunov(flexible.A, -flexible.B @ flexible.B.T)
    W = solve_continuous_lyapunov(flexible.A.T, -flexible.C.T @ flexible.C)
    expected = np.sort(np.sqrt(np.abs(np.linalg.eigvals(P @ W))))[::-1]
    assert_allclose(balanced_truncation(system, 4).hankel[:8], expected[:8], rtol=1e-7)


@pytest.mark.parametrize("friction", [0.0, 1e-6, 0.05, 2.0])
@pytest.mark.parametrize("coordinates", ["modal", "physical"])
def test_rigid_body_is_kept_exactly(friction: float, coordinates: str) -> None:
    """Its poles, and the reduction's agreement with the arm where only they matter."""
    model = truth(arm_with(0.005, friction), 10)
    system = state_space(model, ["theta", "tip"], coordinates=coordinates)
    reduced = balanced_truncation(system, 2).system
    assert_array_equal(reduced.A[:, 0], [0, 0])
    assert reduced.A[0, 1] == 1
    slow = reduced.A[1, 1]
    if friction == 0:
        assert slow == 0
    else:
        poles = np.linalg.eigvals(state_space(model, "theta", coordinates="modal").A)
        assert_allclose(slow, poles[np.abs(poles - slow).argmin()].real, rtol=1e-9, atol=1e-13)
        # A weak friction damps the free rotation at c/J.
        if friction < 1e-3:
            assert_allclose(-slow, friction / model.mass[0, 0], rtol=1e-4)
    low = 1e-5
    assert_allclose(response(reduced, low), response(system, low), rtol=1e-5)


@pytest.mark.parametrize("friction", [0.0, 0.05])
def test_coordinates_do_not_matter(friction: float) -> None:
    model = truth(arm_with(1e-4, friction), 10)
    found = [
        balanced_truncation(state_space(model, ["theta", "tip"], coordinates=c), 8)
        for c in ("modal", "physical")
    ]
    assert_allclose(found[0].hankel[:12], found[1].hankel[:12], rtol=1e-8)
    for omega in (0.7, 20.0, 300.0):
        assert_allclose(
            response(found[0].system, omega), response(found[1].system, omega), rtol=1e-7
        )


@deterministic(30)
@given(arm=arms(damping=True))
def test_parts_add_up_to_the_system(arm: Arm) -> None:
    model = truth(arm, 6)
    system = state_space(model, ["theta", "tip"], coordinates="modal")
    parts = separate(system)
    assert len(parts.rigid.A) + len(parts.poles) == system.nstates
    for omega in (0.31, 3.3, 33.0):
        s = 1j * omega
        rigid = parts.rigid.C @ np.linalg.solve(s * np.eye(2) - parts.rigid.A, parts.rigid.B)
        whole = response(system, omega)
        assert_allclose(rigid + parts.response(s), whole, atol=1e-9 * np.abs(whole).max())


def test_overdamped_modes_are_found_in_pairs() -> None:
    """Kelvin–Voigt: λ₁λ₂ = ω² of each mode, however its poles lie."""
    model = truth(replace(arm_with(0.0), damping=KelvinVoigt(0.1)), 8)
    ratios = 0.1 * model.omega / 2
    assert ratios[0] < 1 < ratios[1]
    system = state_space(model, ["tip"], coordinates="modal")
    assert_allclose(separate(system).frequencies, model.omega, rtol=1e-9)
    assert balanced_truncation(system, 6).bound > 0


def test_friction_beside_overdamped_modes() -> None:
    model = truth(replace(arm_with(0.0, 0.05), damping=KelvinVoigt(0.1)), 8)
    parts = separate(state_space(model, ["tip"], coordinates="modal"))
    assert [len(mode) for mode in parts.modes] == [2] * 8
    assert_allclose(parts.frequencies, model.omega, rtol=2e-2)


@pytest.mark.parametrize("outputs", [["theta", "tip"], ["tip_acceleration", "theta_dot"]])
def test_modal_truncation_is_the_truth_with_fewer_modes(outputs: list[str]) -> None:
    """An acceleration's D must lose the removed modes: that is the static correction."""
    arm = arm_with()
    large, small = (state_space(truth(arm, n), outputs, coordinates="modal") for n in (9, 3))
    accelerates = outputs[0] == "tip_acceleration"
    reduced = modal_truncation(large, 3, static_correction=accelerates).system
    assert reduced.input_labels == large.input_labels
    assert reduced.output_labels == large.output_labels
    for omega in (0.2, 13.0, 170.0):
        expected = response(small, omega)
        assert_allclose(response(reduced, omega), expected, atol=1e-8 * np.abs(expected).max())


def test_static_correction_is_exact_at_rest() -> None:
    system = state_space(truth(arm_with(), 9), ["theta", "tip"], coordinates="modal")
    flexible = without(system, [0, 10])
    reduced = without(modal_truncation(system, 2).system, [0, 1])
    bare = without(modal_truncation(system, 2, False).system, [0, 1])
    assert_allclose(response(reduced, 0.0), response(flexible, 0.0), rtol=1e-9)
    assert np.abs(response(bare, 0.0) - response(flexible, 0.0)).max() > 1e-7
    assert_array_equal(bare.D, 0)


def test_full_order_gives_the_system_back() -> None:
    system = state_space(truth(arm_with(0.01), 4), ["theta", "tip"], coordinates="modal")
    for reduced in (balanced_truncation(system, 10), modal_truncation(system, 4)):
        assert reduced.bound == 0
        for omega in (0.5, 20.0):
            assert_allclose(response(reduced.system, omega), response(system, omega), rtol=1e-8)


def test_generalised_plant_keeps_its_names_and_its_problem() -> None:
    plant = plant_of(arm_with())
    for reduced in (balanced_truncation(plant, 8), modal_truncation(plant, 3)):
        small = reduced.plant
        assert small is not None
        assert small.model is None
        assert (reduced.order, small.system.nstates) == (8, 8)
        assert small.sensors == plant.sensors
        assert small.system.input_labels == plant.system.input_labels
        assert small.system.output_labels == plant.system.output_labels
        assert_array_equal(small.D12, plant.D12)
        assert_array_equal(small.D21, plant.D21)
        assert_array_equal(small.system.D, plant.system.D)
        controller = lqg(small)
        assert controller.certificate.verified, controller.certificate
        assert controller.system.nstates == 8


@pytest.mark.parametrize("path", ["all", "control"])
def test_error_of_a_generalised_plant_is_below_the_bound(path: str) -> None:
    """All inputs to all outputs, by the largest singular value on a grid about every pole."""
    plant = plant_of(arm_with(0.002), 10)
    reduced = balanced_truncation(plant, 8, path=path)
    G, Gr = without(plant.system, [0, 11]), without(reduced.system, [0, 1])
    unit_in = np.array([reduced.sizes.get(name, 0.0) for name in plant.system.input_labels])
    unit_out = np.array([1 / reduced.sizes.get(n, np.inf) for n in plant.system.output_labels])
    poles = np.abs(np.linalg.eigvals(G.A))
    grid = np.concatenate([poles * (1 + 0.002 * k) for k in range(-3, 4)])
    worst = max(
        np.linalg.norm(unit_out[:, None] * (response(G, w) - response(Gr, w)) * unit_in, 2)
        for w in grid
    )
    assert 0.999 * reduced.error <= worst * 1.01
    assert worst <= reduced.bound
    assert worst >= 0.9 * reduced.hankel[6]


@pytest.mark.parametrize("path", ["all", "control"])
def test_units_of_actuator_and_sensors_do_not_matter(path: str) -> None:
    plant = plant_of(arm_with(0.01, 0.02), 8)
    system = plant.system
    into, out = np.ones(system.ninputs), np.ones(system.noutputs)
    into[-1], out[plant.performance] = 1e-3, 1e3
    scaled = control.StateSpace(
        system.A, system.B * into, out[:, None] * system.C, out[:, None] * system.D * into,
        inputs=system.input_labels, outputs=system.output_labels,
    )  # fmt: skip
    one = balanced_truncation(plant, 6, path=path)
    two = balanced_truncation(replace(plant, system=scaled), 6, path=path)
    assert_allclose(two.hankel[:8], one.hankel[:8], rtol=1e-8)
    for omega in (1.0, 40.0):
        expected = out[:, None] * response(one.system, omega) * into
        assert_allclose(response(two.system, omega), expected, atol=1e-8 * np.abs(expected).max())


def test_sizes_of_a_plain_system_are_units() -> None:
    system = state_space(truth(arm_with(), 8), ["theta", "theta_dot"], coordinates="modal")
    sizes = {"theta": 1e-3, "theta_dot": 2.0, "torque": 5.0}
    one = balanced_truncation(system, 6, sizes=sizes)
    scaled = control.StateSpace(
        system.A, 5 * system.B, np.diag([1e3, 0.5]) @ system.C, np.zeros((2, 1))
    )
    two = balanced_truncation(scaled, 6)
    assert_allclose(one.hankel[:8], two.hankel[:8], rtol=1e-10)
    assert_allclose(one.bound, two.bound, rtol=1e-10)
    assert one.sizes == sizes


def test_corrected_controller_closes_the_same_loop() -> None:
    """K around C(s − A)⁻¹B is K corrected around the same with the feedthrough."""
    plant = plant_of(arm_with())
    reduced = modal_truncation(plant, 2)
    assert reduced.plant is not None
    K0 = lqg(reduced.plant).system
    K, D = reduced.corrected(K0), reduced.feedthrough
    assert np.abs(D).min() > 0
    G = reduced.plant.control_path
    expected = np.linalg.eigvals(np.block([[G.A, G.B @ K0.C], [K0.B @ G.C, K0.A]]))
    # y = C x + D u: u = Ck xk, since K is strictly proper.
    closed = np.block([[G.A, G.B @ K.C], [K.B @ G.C, K.A + K.B @ D @ K.C]])
    assert_allclose(
        np.sort_complex(np.linalg.eigvals(closed)), np.sort_complex(expected), rtol=1e-7
    )
    assert K.input_labels == K0.input_labels


def test_corrected_controller_with_feedthrough() -> None:
    reduced = modal_truncation(plant_of(arm_with()), 2)
    D = reduced.feedthrough
    K0 = control.StateSpace([[-2.0]], [[1.0, 0.5]], [[3.0]], [[-0.2, 4.0]])
    K = reduced.corrected(K0)
    s = 1.7j
    # u = K₀(y − D u).
    expected = np.linalg.solve(1 + K0(s).reshape(1, 2) @ D, K0(s).reshape(1, 2))
    assert_allclose(K(s).reshape(1, 2), expected, rtol=1e-12)
    uncorrected = modal_truncation(plant_of(arm_with()), 2, False)
    assert uncorrected.corrected(K0) is K0


@pytest.mark.parametrize("correction", [False, True])
def test_undamped_modes_can_be_cut_but_not_balanced(correction: bool) -> None:
    system = state_space(truth(arm_with(0.0), 5), ["tip"], coordinates="modal")
    reduced = modal_truncation(system, 2, correction)
    assert reduced.bound == np.inf
    assert np.abs(np.linalg.eigvals(reduced.system.A).real).max() < 1e-9
    with pytest.raises(InputError, match="undamped") as error:
        balanced_truncation(system, 4)
    assert "modal_truncation" in error.value.remedy


def test_what_cannot_be_reduced_is_refused() -> None:
    system = state_space(truth(arm_with(), 4), ["tip"], coordinates="modal")
    plant = plant_of(arm_with(), 4)
    for call in (
        lambda: balanced_truncation(system, 1),
        lambda: balanced_truncation(system, 11),
        lambda: balanced_truncation(system, 2.5),
        lambda: balanced_truncation(system, 4, path="controll"),
        lambda: balanced_truncation(system, 4, path="control"),
        lambda: balanced_truncation(system, 4, sizes={"tipp": 1.0}),
        lambda: balanced_truncation(system, 4, sizes={"tip": 0.0}),
        lambda: balanced_truncation(plant, 4, sizes={"tip": 1.0}),
        lambda: balanced_truncation("system", 4),
        lambda: balanced_truncation(system.sample(0.01), 4),
        lambda: modal_truncation(system, 5),
        lambda: modal_truncation(system, -1),
        lambda: balanced_truncation(control.ss([[1.0]], [[1.0]], [[1.0]], 0), 1),
        lambda: balanced_truncation(control.ss(np.diag([1.0, 1.0], 1), np.ones((3, 1)), np.ones((1, 3)), 0), 2),
        lambda: balanced_truncation(control.ss(np.zeros((3, 3)), np.ones((3, 1)), np.ones((1, 3)), 0), 2),
    ):  # fmt: skip
        with pytest.raises(InputError) as error:
            call()
        assert error.value.where
        assert error.value.remedy


def test_states_that_nothing_reaches_do_not_count() -> None:
    A = np.diag([-1.0, -2.0, -3.0])
    system = control.ss(A, [[1.0], [1.0], [0.0]], [[1.0, 1.0, 1.0]], 0)
    assert balanced_truncation(system, 2).bound < 1e-15
    with pytest.raises(InputError, match="only 2 flexible states"):
        balanced_truncation(system, 3)


def test_forty_light_modes_keep_their_accuracy() -> None:
    """ζ = 1e-4, 40 modes: damping and Hankel values mode by mode as in closed form."""
    model = truth(arm_with(1e-4), 40)
    parts = separate(state_space(model, ["tip"], coordinates="modal"))
    damping = -parts.poles.real[::2] / np.abs(parts.poles[::2])
    assert_allclose(damping, 1e-4, rtol=1e-9)
    assert parts.residual < 1e-9
    tip = (model.displacement(np.ones(1)) @ model.mode_shapes)[0, 1:]
    gain = np.abs(model.mode_shapes[0, 1:] * tip) / (4e-4 * model.omega**2)
    # Far apart and lightly damped, each mode has its own pair of about |b c|/(4ζω²).
    hankel = balanced_truncation(state_space(model, ["tip"], coordinates="modal"), 4).hankel
    assert_allclose(hankel[::2], np.sort(gain)[::-1], rtol=2e-3)


def companion(numerator: list[float], poles: list[complex]) -> control.StateSpace:
    """The transfer function in companion form: multiple poles have one eigenvector."""
    n = len(poles)
    A = np.eye(n, k=-1)
    A[0] = -np.poly(poles).real[1:]
    return control.StateSpace(A, np.eye(n, 1), [[0.0] * (n - len(numerator)) + numerator], 0)


def test_hankel_values_of_a_textbook_system_with_a_double_pole() -> None:
    """(8s² + 6s + 2)/(s³ + 4s² + 5s + 2): poles −1, −1 and −2."""
    reduced = balanced_truncation(companion([8.0, 6.0, 2.0], [-1, -1, -2]), 2)
    assert_allclose(reduced.hankel, [1.144118688, 0.725878969, 0.0817602814], rtol=2e-9)
    assert reduced.error <= reduced.bound * (1 + 1e-12)


def test_hankel_values_of_two_equal_lags() -> None:
    """1/(s + 1)²: the mode with ζ = 1 of `test_hankel_values_of_one_mode_in_closed_form`."""
    hankel = balanced_truncation(companion([1.0], [-1, -1]), 1).hankel
    assert_allclose(hankel, [(np.sqrt(2) + 1) / 4, (np.sqrt(2) - 1) / 4], rtol=1e-14)


@deterministic(40)
@given(
    spacing=st.floats(-16, -0.5).map(lambda e: 10.0**e),
    copies=st.integers(2, 6),
    pair=st.booleans(),
    seed=st.integers(0, 99),
)
def test_poles_that_nearly_coincide_are_reduced_in_any_coordinates(
    spacing: float, copies: int, pair: bool, seed: int
) -> None:
    """Against scipy's Gramians in companion form, and in coordinates turned at random."""
    rng = np.random.default_rng(seed)
    base: list[complex] = [complex(-1 - k * spacing) for k in range(copies)]
    if pair:
        base = [pole * turn for pole in base[: (copies + 1) // 2] for turn in (0.3 + 1j, 0.3 - 1j)]
    system = companion([1.0, 2.0], [*base, -4.0])
    P = solve_continuous_lyapunov(system.A, -system.B @ system.B.T)
    W = solve_continuous_lyapunov(system.A.T, -system.C.T @ system.C)
    expected = np.sort(np.sqrt(np.abs(np.linalg.eigvals(P @ W))))[::-1]
    turn = np.linalg.qr(rng.standard_normal((system.nstates, system.nstates)))[0]
    turned = control.StateSpace(turn @ system.A @ turn.T, turn @ system.B, system.C @ turn.T, 0)
    for given_system in (system, turned):
        reduced = balanced_truncation(given_system, 2)
        assert_allclose(reduced.hankel[:2], expected[:2], rtol=1e-7)
        assert reduced.error <= reduced.bound * (1 + 1e-7) + 1e-11
        for omega in (0.0, 0.9, 7.0):
            far = np.abs(response(given_system, omega) - response(reduced.system, omega)).max()
            assert far <= reduced.bound * (1 + 1e-7) + 1e-11


def test_an_arm_with_a_critically_damped_mode_is_reduced() -> None:
    """Kelvin–Voigt damping with ηω/2 = 1 for the second mode: a double pole at −ω."""
    bare = truth(arm_with(0.0), 6)
    model = truth(replace(arm_with(0.0), damping=KelvinVoigt(2 / bare.omega[1])), 6)
    system = state_space(model, ["theta", "tip"], coordinates="modal")
    flexible = without(system, [0, 7])
    P = solve_continuous_lyapunov(flexible.A, -flexible.B @ flexible.B.T)
    W = solve_continuous_lyapunov(flexible.A.T, -flexible.C.T @ flexible.C)
    expected = np.sort(np.sqrt(np.abs(np.linalg.eigvals(P @ W))))[::-1]
    assert_allclose(balanced_truncation(system, 5).hankel[:4], expected[:4], rtol=1e-7)
    assert_allclose(separate(system).frequencies, bare.omega, rtol=1e-7)
    kept = modal_truncation(system, 2, static_correction=False)
    assert_allclose(np.abs(np.linalg.eigvals(kept.system.A[4:, 4:])), bare.omega[[1, 1]], rtol=1e-6)
    assert kept.error <= kept.bound * (1 + 1e-9)


def test_modes_of_coinciding_poles_are_kept_or_cut_together() -> None:
    pair = [-0.01 + 1j, -0.01 - 1j]
    system = companion([1.0, 2.0], [*pair, *pair, -3.0])
    reduced = modal_truncation(system, 1)
    assert [len(mode) for mode in separate(system).modes] == [4, 1]
    assert reduced.system.nstates == 4
    assert_allclose(response(reduced.system, 0.0), response(system, 0.0), rtol=1e-10)
    with pytest.raises(InputError, match="2 flexible modes"):
        modal_truncation(system, 3)
