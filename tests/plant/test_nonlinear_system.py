"""The nonlinear plant in python-control: names, linearisation, simulation, interconnection."""

from __future__ import annotations

import warnings

import control
import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal
from strategies import arms, deterministic

from slewctl import Arm, Beam, ClampedFree, Hub, InputError, Payload, Slewing, assemble, state_space
from slewctl.arm import Motor
from slewctl.model.nonlinear import large_slew
from slewctl.model.spin import SpinSofteningWarning
from slewctl.plant import SIGNALS
from slewctl.plant.nonlinear import nonlinear_system

EPS = np.finfo(float).eps
EVERY = (*(name for name in SIGNALS if name != "root_moment"), "moment@200mm", "acceleration@700mm")


def assert_same_linearisation(
    system: control.NonlinearIOSystem, linear: control.StateSpace
) -> None:
    """Difference quotients at rest, where the equations are odd: no term of second order.

    At zero nothing cancels, so the step can be far below where third-order terms show.
    """
    found = control.linearize(system, np.zeros(system.nstates), np.zeros(1), eps=1e-12)
    for name in "ABCD":
        a, b = np.asarray(getattr(found, name)), np.asarray(getattr(linear, name))
        assert_allclose(a, b, rtol=0, atol=1e-9 * max(1.0, np.abs(b).max()))


@given(arms(damping=True))
@deterministic(15)
def test_linearised_about_rest_it_is_the_linear_model(arm: Arm) -> None:
    model = assemble(arm, ClampedFree(3))
    linear = state_space(model, EVERY)
    for stiffening in (True, False):
        assert_same_linearisation(nonlinear_system(model, EVERY, stiffening=stiffening), linear)


def test_names_are_those_of_the_linear_model(full_arm: Arm) -> None:
    model = assemble(full_arm, Slewing(3))
    system, linear = nonlinear_system(model, EVERY), state_space(model, EVERY)
    assert isinstance(system, control.NonlinearIOSystem)
    assert system.input_labels == linear.input_labels
    assert system.output_labels == linear.output_labels
    assert system.state_labels == linear.state_labels
    assert system.isctime(strict=True)
    assert nonlinear_system(model, "tip").output_labels == ["tip"]


def test_voltage_drives_through_the_motor() -> None:
    motor = Motor(2.6, 7.68e-3, 7.68e-3, gear_ratio=70.0)
    arm = Arm(Beam(0.4, 0.16, 0.19), Hub(2e-3), motor=motor)
    model = assemble(arm, ClampedFree(2))
    system = nonlinear_system(model, ("theta", "tip_acceleration"), input="voltage")
    assert system.input_labels == ["voltage"]
    assert_same_linearisation(
        system, state_space(model, ("theta", "tip_acceleration"), input="voltage")
    )


def test_outputs_are_rows_of_motion_rate_and_acceleration(full_arm: Arm) -> None:
    model = assemble(full_arm, ClampedFree(3))
    equations = large_slew(model)
    state = np.array([0.4, 0.02, -0.01, 0.004, 2.5, 0.3, -0.2, 0.1])
    system = nonlinear_system(model, ("theta", "tip", "theta_dot", "tip_dot", "tip_acceleration"))
    row = model.displacement(np.array([1.3]))[0]
    acceleration = equations.accelerations(state[:4], state[4:], 0.6)
    expected = [0.4, row @ state[:4], 2.5, row @ state[4:], row @ acceleration]
    assert_allclose(system.output(0.0, state, [0.6]), expected, rtol=20 * EPS)
    assert_array_equal(system.dynamics(0.0, state, [0.6]), equations.derivative(state, 0.6))


def test_simulated_small_slew_is_the_linear_one_to_third_order(full_arm: Arm) -> None:
    """The equations are odd: what the linear model leaves out falls with the cube."""
    model = assemble(full_arm, ClampedFree(2))
    outputs = ("theta", "tip_deflection")
    t = np.linspace(0.0, 0.5, 51)
    linear = control.forced_response(state_space(model, outputs), t, np.sin(8 * t)).outputs
    system = nonlinear_system(model, outputs)
    gaps = []
    for torque in (2.0, 8.0):
        found = control.input_output_response(
            system, t, torque * np.sin(8 * t), solve_ivp_kwargs={"rtol": 1e-11, "atol": 1e-13}
        ).outputs
        gaps.append(np.abs(found - torque * linear)[1].max())
    # The fifth order is a hundredth of the third here; 64 is four cubed.
    assert gaps[1] / gaps[0] == pytest.approx(64, rel=0.05)
    assert gaps[0] > 1e-9


@pytest.mark.slow
def test_a_linear_controller_holds_the_nonlinear_arm(full_arm: Arm) -> None:
    """The same PD law around either plant: equal for a small turn, settled after a large one."""
    model = assemble(full_arm, ClampedFree(2))
    law = control.StateSpace(
        [], [], [], [[-20.0, -12.0, 20.0]], inputs=["theta", "theta_dot", "target"], outputs=["torque"], name="law"
    )  # fmt: skip
    t = np.linspace(0.0, 4.0, 81)

    def turned(plant: control.InputOutputSystem, angle: float) -> np.ndarray:
        loop = control.interconnect(
            [plant, law], inputs=["target"], outputs=["theta"], name=f"{plant.name}_loop"
        )
        tight = {"method": "DOP853", "rtol": 1e-7, "atol": 1e-10}
        return control.input_output_response(loop, t, angle + 0 * t, solve_ivp_kwargs=tight).outputs

    outputs = ("theta", "theta_dot")
    nonlinear = nonlinear_system(model, outputs)
    small = turned(nonlinear, 1e-3)
    assert_allclose(small, turned(state_space(model, outputs), 1e-3), rtol=0, atol=1e-8)
    # Slowest pole near −0.9/s: after 6 s less than one per cent of the turn is left.
    assert turned(nonlinear, 2.0)[-1] == pytest.approx(2.0, abs=0.02)


def test_spinning_past_the_critical_rate_warns_without_stiffening_only() -> None:
    model = assemble(Arm(Beam(1.0, 1.0, 1.0), Hub(0.3)), ClampedFree(3))
    state = np.zeros(8)
    state[4] = 3.6  # the cantilever's lowest frequency is 3.516 rad/s
    with pytest.warns(SpinSofteningWarning, match=r"3\.6 rad/s .* 3\.516 rad/s"):
        nonlinear_system(model, stiffening=False).dynamics(0.0, state, [0.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error", SpinSofteningWarning)
        nonlinear_system(model).dynamics(0.0, state, [0.0])
        state[4] = 3.4
        nonlinear_system(model, stiffening=False).dynamics(0.0, state, [0.0])


def test_steady_spin_linearises_to_the_spin_stiffness(full_arm: Arm) -> None:
    """About θ̇ = Ω with q = 0 the deflection's stiffness is K_e − Ω²S, and θ̇ drops out of it."""
    arm = Arm(full_arm.beam, Hub(0.7, 0.12), Payload(0.4, 0.02))
    model = assemble(arm, ClampedFree(3))
    spin = 4.0
    state = np.zeros(8)
    state[4] = spin
    found = np.asarray(control.linearize(nonlinear_system(model), state, [0.0]).A)
    stiffness = np.zeros((4, 4))
    stiffness[1:, 1:] = model.stiffness[1:, 1:] - spin**2 * large_slew(model).softening
    expected = -np.linalg.solve(model.mass, stiffness)
    # Forward differences of 1e-6: the quadratic terms in θ̇ and q vanish at q = 0.
    assert_allclose(found[4:, :4], expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert_allclose(found[4:, 4:], 0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"outputs": ["tipp"]}, "did you mean 'tip'"),
        ({"input": "volts"}, "did you mean 'voltage'"),
        ({"input": "voltage"}, "has no motor"),
    ],
)
def test_nonlinear_system_refuses_nonsense(full_arm: Arm, arguments: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        nonlinear_system(assemble(full_arm, Slewing(2)), **arguments)
