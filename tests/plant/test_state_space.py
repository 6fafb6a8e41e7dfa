"""State-space models: eq. 44, named signals, sampling, and use within python-control."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import expm
from strategies import arms, deterministic

from slewctl import Arm, Beam, ClampedFree, Hub, InputError, Polynomial, Slewing, assemble, truth
from slewctl.model import Model
from slewctl.plant import SIGNALS, state_space

EPS = np.finfo(float).eps
ALL = tuple(SIGNALS)
BASES = [ClampedFree(3), Slewing(3), Polynomial(3)]
every_basis = pytest.mark.parametrize("basis", BASES, ids=lambda basis: basis.name)


def response(system: control.StateSpace, omega: float) -> np.ndarray:
    return np.asarray(system(1j * omega)).reshape(system.noutputs)


@every_basis
def test_physical_matrices_are_equation_44_with_damping(basis: object, full_arm: Arm) -> None:
    """A = [[0, I], [−M⁻¹K, −M⁻¹D]], B = [0, M⁻¹b]; LU on M leaves ε·cond(M)."""
    model = assemble(full_arm, basis)
    plant = state_space(model, ALL)
    M, D, K, b = model.mass, model.damping, model.stiffness, model.input
    Z, one = np.zeros((4, 4)), np.eye(4)
    A = np.block([[Z, one], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    tolerance = 16 * EPS * np.linalg.cond(M)
    assert_array_equal(plant.A[:4], A[:4])
    for rows in (slice(0, 4), slice(4, 8)):
        block = A[4:, rows]
        assert_allclose(plant.A[4:, rows], block, rtol=0, atol=tolerance * np.abs(block).max())
    force = np.linalg.solve(M, b)
    assert_array_equal(plant.B[:4], 0)
    assert_allclose(plant.B[4:, 0], force, rtol=0, atol=tolerance * np.abs(force).max())


@every_basis
def test_modal_matrices_are_diagonal_blocks(basis: object, full_arm: Arm) -> None:
    """η̈ = −diag(0, ω²)η − UᵀDUη̇ + Uᵀbτ; friction at the hub is what couples the modes."""
    arm = Arm(full_arm.beam, Hub(0.7, 0.12), full_arm.payload, damping_ratio=0.02)
    model = assemble(arm, basis)
    plant = state_space(model, coordinates="modal")
    assert_array_equal(plant.A[4:, :4], -np.diag([0.0, *model.omega**2]))
    damping = np.diag([0.0, *(2 * 0.02 * model.omega)])
    tolerance = 64 * EPS * model.omega[-1]
    assert_allclose(plant.A[4:, 4:], -damping, rtol=0, atol=tolerance)
    assert_allclose(plant.B[4:, 0], model.mode_shapes[0], rtol=4 * EPS)


def test_signals_and_states_have_names(full_arm: Arm) -> None:
    model = assemble(full_arm, ClampedFree(2))
    physical = state_space(model, ["tip", "theta"])
    assert physical.input_labels == ["torque"]
    assert physical.output_labels == ["tip", "theta"]
    assert physical.state_labels == ["theta", "q1", "q2", "theta_dot", "q1_dot", "q2_dot"]
    assert physical.name == "clamped_free_2"
    assert physical.isctime(strict=True)
    modal = state_space(model, coordinates="modal", sample_time=0.01)
    names = ["rigid", "mode1", "mode2"]
    assert modal.state_labels == [*names, *(f"{name}_dot" for name in names)]
    assert modal.input_labels == ["torque"]
    assert modal.output_labels == ["theta", "theta_dot", "tip"]
    assert modal.dt == 0.01


@given(arms(damping=True), st.sampled_from(BASES), st.floats(-1, 2))
@deterministic(40)
def test_physical_and_modal_coordinates_have_one_transfer_function(
    arm: Arm, basis: object, decade: float
) -> None:
    """Compared relative to |C| times the state's size: near a zero the terms cancel."""
    model, omega = assemble(arm, basis), 10.0**decade
    # On an undamped resonance the response amplifies rounding without bound: keep 1 % off.
    assume(np.all(np.abs(omega / model.omega - 1) > 1e-2))
    # Without a hub the slewing functions cannot carry a root moment, and it is refused.
    outputs = [name for name in ALL if name != "root_moment" or arm.hub.inertia > 0]
    modal = state_space(model, outputs, coordinates="modal")
    physical = state_space(model, outputs)
    state = np.linalg.solve(1j * omega * np.eye(8) - physical.A, physical.B)
    size = np.linalg.norm(physical.C, axis=1) * np.linalg.norm(state) + np.abs(physical.D[:, 0])
    # −M⁻¹K carries ε·ω_n²·cond(M) against ω²; a hundredfold near a resonance.
    spread = 1 + (model.omega[-1] / min(omega, model.omega[0])) ** 2
    error = np.abs(response(physical, omega) - response(modal, omega))
    assert np.all(error <= 100 * EPS * spread * size)


@every_basis
@pytest.mark.parametrize("coordinates", ["physical", "modal"])
def test_each_output_is_what_it_says(basis: object, coordinates: str, full_arm: Arm) -> None:
    """Solve (−ω²M + iωD + K)x = b for [θ, q] and form every output from its definition."""
    model, omega = assemble(full_arm, basis), 5.0
    dynamic = -(omega**2) * model.mass + 1j * omega * model.damping + model.stiffness
    x = np.linalg.solve(dynamic, model.input)
    L, r = 1.3, 0.12
    v = basis.evaluate(np.ones(1))[0] @ x[1:]
    curvature = basis.evaluate(np.zeros(1), 2)[0] @ x[1:] / L**2
    tip = (r + L) * x[0] + v
    expected = {
        "theta": x[0],
        "theta_dot": 1j * omega * x[0],
        "theta_motor": x[0],  # no joint between
        "theta_motor_dot": 1j * omega * x[0],
        "tip": tip,
        "tip_dot": 1j * omega * tip,
        "tip_acceleration": -(omega**2) * tip,
        "tip_deflection": v,
        "root_moment": 40.0 * curvature,  # EI(0) = 40
    }
    got = response(state_space(model, ALL, coordinates=coordinates), omega)
    assert set(expected) == set(ALL)
    tolerance = 64 * EPS * np.linalg.cond(dynamic)
    for name, value in zip(ALL, got, strict=True):
        assert abs(value - expected[name]) <= tolerance * max(abs(expected[name]), np.abs(x).max())


@every_basis
def test_tip_acceleration_feels_the_torque_at_once(basis: object, full_arm: Arm) -> None:
    """D = [r + L, Φ(L)] M⁻¹ b, and every other output has none."""
    model = assemble(full_arm, basis)
    plant = state_space(model, ALL)
    row = np.concatenate([[1.42], basis.evaluate(np.ones(1))[0]])
    expected = row @ np.linalg.solve(model.mass, model.input)
    at = ALL.index("tip_acceleration")
    size = np.abs(row) @ np.abs(np.linalg.solve(model.mass, model.input))
    assert plant.D[at, 0] == pytest.approx(
        expected, abs=16 * EPS * np.linalg.cond(model.mass) * size
    )
    assert expected != 0
    assert_array_equal(np.delete(plant.D[:, 0], at), 0)


@every_basis
@pytest.mark.parametrize("coordinates", ["physical", "modal"])
@pytest.mark.parametrize("step", [1e-3, 0.05])
def test_sampled_model_is_the_exact_zero_order_hold(
    basis: object, coordinates: str, step: float, full_arm: Arm
) -> None:
    """exp([[A, B], [0, 0]] T), computed on A T balanced in no way: ε times its norm."""
    model = assemble(full_arm, basis)
    plant = state_space(model, ALL, coordinates=coordinates)
    sampled = state_space(model, ALL, coordinates=coordinates, sample_time=step)
    augmented = np.zeros((9, 9))
    augmented[:8, :8], augmented[:8, 8:] = plant.A, plant.B
    whole = expm(augmented * step)
    tolerance = 16 * EPS * np.linalg.norm(augmented * step) * np.abs(whole).max()
    assert_allclose(sampled.A, whole[:8, :8], rtol=0, atol=tolerance)
    assert_allclose(sampled.B, whole[:8, 8:], rtol=0, atol=tolerance)
    assert_array_equal(sampled.C, plant.C)
    assert_array_equal(sampled.D, plant.D)
    assert sampled.dt == step


@every_basis
def test_arm_turns_as_a_rigid_body_at_low_frequency(basis: object) -> None:
    """tip → (r + L)/(J s²) and theta → 1/(J s²), with corrections of order (ω/ω_1)²."""
    arm = Arm(Beam(1.0, 3.0, 5.0), Hub(0.4, 0.2))
    model, omega = assemble(arm, basis), 1e-3
    J = 0.4 + 3.0 * (1.2**3 - 0.2**3) / 3
    theta, tip = response(state_space(model, ["theta", "tip"], coordinates="modal"), omega)
    assert theta == pytest.approx(-1 / (J * omega**2), rel=(omega / model.omega[0]) ** 2 * 10)
    assert tip == pytest.approx(-1.2 / (J * omega**2), rel=(omega / model.omega[0]) ** 2 * 10)


def test_friction_limits_the_speed(full_arm: Arm) -> None:
    """c_h θ̇ = τ at rest of everything else: theta_dot has the static gain 1/c_h."""
    model = assemble(full_arm, Slewing(2))
    rate = response(state_space(model, ["theta_dot"], coordinates="modal"), 1e-6)[0]
    assert rate == pytest.approx(1 / 0.3, rel=1e-5)  # (ωJ/c_h)² and ωJ/c_h ~ 1e-5


def test_poles_are_those_of_the_damped_modes() -> None:
    """Without friction: s² + 2ζωs + ω² for every mode, and the rigid body twice at zero."""
    arm = Arm(Beam(1.0, 3.0, 5.0), Hub(0.4, 0.2), damping_ratio=0.03)
    model = truth(arm, 6)
    poles = state_space(model, coordinates="modal").poles()
    flexible = np.sort_complex(poles[np.abs(poles) > 1e-3 * model.omega[0]])
    exact = model.omega * (-0.03 + 1j * np.sqrt(1 - 0.03**2))
    exact = np.sort_complex(np.concatenate([exact, exact.conj()]))
    assert len(poles) - len(flexible) == 2
    assert_allclose(flexible, exact, rtol=0, atol=64 * EPS * model.omega[-1] ** 2)


def test_python_control_takes_the_model(full_arm: Arm) -> None:
    """frequency_response, forced_response and interconnect, each against a direct result."""
    model = assemble(full_arm, Slewing(2))
    plant = state_space(model, ["theta", "theta_dot"], coordinates="modal")
    omega = np.array([0.5, 3.0])
    curve = control.frequency_response(plant, omega)
    assert_allclose(curve.frdata[:, 0, :].T, [response(plant, w) for w in omega], rtol=1e-12)
    magnitude = control.frequency_response(plant["theta", "torque"], omega).magnitude
    assert_allclose(np.ravel(magnitude), [abs(response(plant, w)[0]) for w in omega], rtol=1e-12)
    time = np.linspace(0, 1, 201)
    motion = control.forced_response(plant, time, np.ones_like(time))
    state = np.zeros((6, 1))
    sampled = state_space(model, ["theta", "theta_dot"], coordinates="modal", sample_time=0.005)
    for _ in range(200):
        state = sampled.A @ state + sampled.B
    end = (sampled.C @ state)[:, 0]
    assert_allclose(motion.outputs[:, -1], end, rtol=1e-9)


def test_named_signals_close_a_loop_by_interconnect(full_arm: Arm) -> None:
    """u = −k θ − d θ̇ through names alone gives A − B K."""
    plant = state_space(assemble(full_arm, Slewing(2)), ["theta", "theta_dot"])
    gain = np.array([[-4.0, -1.5]])
    feedback = control.ss([], [], [], gain, inputs=["theta", "theta_dot"], outputs=["torque"])
    loop = control.interconnect([plant, feedback], inputs=["torque"], outputs=["theta"])
    assert_allclose(loop.A, plant.A + plant.B @ gain @ plant.C, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        (["tipp"], "did you mean 'tip'"),
        ([], "no output or one twice"),
        (["tip", "tip"], "no output or one twice"),
        (["torque"], "outputs"),
        ("thet", "outputs"),
        ([3], "outputs"),
    ],
)
def test_wrong_outputs_are_refused(outputs: object, message: str, full_arm: Arm) -> None:
    with pytest.raises(InputError, match=message) as error:
        state_space(assemble(full_arm, Slewing(1)), outputs)
    assert error.value.where == "outputs"
    assert error.value.remedy


@pytest.mark.parametrize("step", [0, -0.1, np.nan, np.inf, True, "0.1"])
def test_wrong_sample_times_are_refused(step: object, full_arm: Arm) -> None:
    with pytest.raises(InputError) as error:
        state_space(assemble(full_arm, Slewing(1)), sample_time=step)
    assert error.value.where == "sample_time"


def test_unknown_coordinates_are_refused(full_arm: Arm) -> None:
    with pytest.raises(InputError, match="did you mean 'modal'"):
        state_space(assemble(full_arm, Slewing(1)), coordinates="model")


def test_the_truth_becomes_a_plant_like_any_model(full_arm: Arm) -> None:
    model: Model = truth(full_arm, 20)
    plant = state_space(model, coordinates="modal")
    assert plant.nstates == 2 * 21
    # A hub rate collocated with the torque takes in no negative power: Re G(jω) > 0.
    rate = state_space(model, ["theta_dot"], coordinates="modal")
    assert all(response(rate, w)[0].real > 0 for w in np.geomspace(0.1, 1e4, 50))


def test_stiff_models_keep_a_rigid_body_at_zero() -> None:
    """Physical coordinates multiply M⁻¹K out; its first column must still vanish exactly."""
    plant = state_space(assemble(Arm(Beam(1.0, 1e-3, 1e3)), ClampedFree(12)))
    size = plant.nstates // 2
    assert_array_equal(plant.A[size:, 0], 0)
