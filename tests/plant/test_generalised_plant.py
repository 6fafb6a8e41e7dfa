"""Objectives, the generalised plant they make, and closing a controller around it."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from slewctl import Arm, GeneralisedPlant, InputError, Objective, Slewing, assemble
from slewctl import generalised_plant as build
from slewctl.plant import state_space

LIMITS = {"tip": 0.02, "theta": 0.1, "torque": 3.0}
NOISE = {"torque": 0.05, "theta": 1e-3, "root_moment": 2e-2}
SENSORS = ["theta", "root_moment"]


@pytest.fixture
def plant(full_arm: Arm) -> GeneralisedPlant:
    return build(assemble(full_arm, Slewing(3)), Objective(LIMITS, NOISE))


def random_controller(seed: int, states: int = 4) -> control.StateSpace:
    rng = np.random.default_rng(seed)
    return control.StateSpace(
        rng.normal(size=(states, states)) - 3 * np.eye(states),
        rng.normal(size=(states, 2)),
        rng.normal(size=(1, states)),
        rng.normal(size=(1, 2)),
        inputs=SENSORS,
        outputs=["torque"],
        name="controller",
    )


def test_objective_sorts_its_signals() -> None:
    objective = Objective(LIMITS, NOISE)
    assert objective.performance == ("tip", "theta")
    assert objective.sensors == ("theta", "root_moment")


def test_objective_copies_what_it_was_given() -> None:
    limits = dict(LIMITS)
    objective = Objective(limits, NOISE)
    limits["tip"] = -1.0
    assert objective.limits["tip"] == 0.02


@pytest.mark.parametrize("name", ["limits", "noise"])
@pytest.mark.parametrize(
    ("given", "where", "message"),
    [
        ({"theta": 1.0}, "{}", "no value for torque"),
        ({}, "{}", "no value for torque"),
        ({"torque": 1.0}, "{}", "no output"),
        ({"torque": 1.0, "thetta": 1.0}, "{}", "did you mean 'theta'"),
        ({"torque": 0.0, "theta": 1.0}, "{}.torque", "not positive"),
        ({"torque": 1.0, "theta": -2.0}, "{}.theta", "not positive"),
        ({"torque": 1.0, "theta": np.nan}, "{}.theta", "not a finite number"),
        ({"torque": 1.0, "theta": "1"}, "{}.theta", "not a finite number"),
    ],
)
def test_wrong_objectives_are_refused(
    name: str, given: dict[str, float], where: str, message: str
) -> None:
    fields = {"limits": LIMITS, "noise": NOISE, name: given}
    with pytest.raises(InputError, match=message) as error:
        Objective(**fields)
    assert error.value.where == where.format(name)
    assert error.value.remedy


def test_objective_that_is_no_mapping_is_refused() -> None:
    with pytest.raises(InputError):
        Objective(["torque", "tip"], NOISE)


def test_signals_are_named_and_counted(plant: GeneralisedPlant) -> None:
    assert plant.system.input_labels == ["w_torque", "w_theta", "w_root_moment", "torque"]
    assert plant.system.output_labels == ["z_tip", "z_theta", "z_torque", *SENSORS]
    assert (plant.disturbances, plant.performance) == (3, 3)
    assert plant.sensors == ("theta", "root_moment")


def test_partition_is_the_model_weighted(plant: GeneralisedPlant, full_arm: Arm) -> None:
    """Every block from the plain modal plant: B1 = √S_τ B2, C1 = C/limit, D12 = 1/limit."""
    plain = state_space(
        assemble(full_arm, Slewing(3)), ["tip", "theta", "root_moment"], coordinates="modal"
    )
    tip, theta, moment = plain.C
    assert_array_equal(plant.A, plain.A)
    assert_array_equal(plant.B2, plain.B)
    assert_array_equal(plant.B1, np.column_stack([0.05 * plain.B, np.zeros((8, 2))]))
    assert_array_equal(plant.C1, [tip / 0.02, theta / 0.1, np.zeros(8)])
    assert_array_equal(plant.C2, [theta, moment])
    assert_array_equal(plant.D12, [[0], [0], [1 / 3.0]])
    assert_array_equal(plant.D21, [[0, 1e-3, 0], [0, 0, 2e-2]])
    D = plant.system.D
    assert_array_equal(D[:3, :3], 0)
    assert_array_equal(D[3:, 3:], 0)


def test_partition_reassembles_the_system(plant: GeneralisedPlant) -> None:
    assert_array_equal(np.hstack([plant.B1, plant.B2]), plant.system.B)
    assert_array_equal(np.vstack([plant.C1, plant.C2]), plant.system.C)
    assert_array_equal(plant.D12, plant.system.D[:3, 3:])
    assert_array_equal(plant.D21, plant.system.D[3:, :3])


def test_control_path_is_the_plain_plant(plant: GeneralisedPlant, full_arm: Arm) -> None:
    plain = state_space(assemble(full_arm, Slewing(3)), SENSORS, coordinates="modal")
    path = plant.control_path
    for name in ("A", "B", "C", "D"):
        assert_array_equal(getattr(path, name), getattr(plain, name))
    assert path.input_labels == ["torque"]
    assert path.output_labels == SENSORS
    assert path.state_labels == plain.state_labels


@pytest.mark.parametrize("place", ["limits", "noise"])
def test_tip_acceleration_is_refused(place: str, full_arm: Arm) -> None:
    fields = {"limits": dict(LIMITS), "noise": dict(NOISE)}
    fields[place]["tip_acceleration"] = 1.0
    with pytest.raises(InputError, match="tip_acceleration responds to the torque") as error:
        build(assemble(full_arm, Slewing(2)), Objective(**fields))
    assert error.value.where == "objective"
    assert "infinite" in error.value.remedy


@pytest.mark.parametrize("seed", range(4))
def test_close_is_the_linear_fractional_transformation(plant: GeneralisedPlant, seed: int) -> None:
    """The same matrices as python-control's own lft, and the same signals by interconnect."""
    controller = random_controller(seed)
    closed = plant.close(controller)
    expected = plant.system.lft(controller, 1, 2)
    for name in ("A", "B", "C", "D"):
        value = getattr(expected, name)
        tolerance = 1e-13 * max(np.abs(value).max(), 1.0)
        assert_allclose(getattr(closed, name), value, rtol=0, atol=tolerance)
    assert closed.input_labels == ["w_torque", "w_theta", "w_root_moment"]
    assert closed.output_labels == ["z_tip", "z_theta", "z_torque"]


@pytest.mark.parametrize("seed", range(4))
def test_close_is_interconnect_by_signal_name(plant: GeneralisedPlant, seed: int) -> None:
    controller = random_controller(seed)
    closed = plant.close(controller)
    wired = control.interconnect(
        [plant.system, controller], inputs=closed.input_labels, outputs=closed.output_labels
    )
    for omega in (0.3, 4.0, 60.0):
        ours, theirs = closed(1j * omega), wired(1j * omega)
        # Both solve with matrices of condition below 1e6.
        assert_allclose(ours, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max())


def test_zero_controller_leaves_the_open_loop(plant: GeneralisedPlant) -> None:
    none = control.ss([], [], [], [[0.0, 0.0]], inputs=SENSORS, outputs=["torque"])
    closed = plant.close(none)
    assert_array_equal(closed.A, plant.A)
    assert_array_equal(closed.B, plant.B1)
    assert_array_equal(closed.C, plant.C1)
    assert_array_equal(closed.D, np.zeros((3, 3)))


def test_constant_gain_is_output_feedback(plant: GeneralisedPlant) -> None:
    gain = np.array([[-2.0, 0.1]])
    static = control.ss([], [], [], gain, inputs=SENSORS, outputs=["torque"])
    closed = plant.close(static)
    assert_allclose(closed.A, plant.A + plant.B2 @ gain @ plant.C2, rtol=1e-14)
    # The torque is seen in z_torque: the sensors' noise goes through the gain.
    assert_allclose(closed.D[2], [0, -2.0 * 1e-3 / 3, 0.1 * 2e-2 / 3], rtol=1e-14)


@pytest.mark.parametrize(
    "inputs", [["root_moment", "theta"], ["theta", "tip"], ["theta"], ["a", "b", "c"]]
)
def test_controller_of_other_sensors_is_refused(plant: GeneralisedPlant, inputs: list[str]) -> None:
    gain = control.ss([], [], [], np.ones((1, len(inputs))), inputs=inputs, outputs=["torque"])
    with pytest.raises(InputError, match="same signals in the same order") as error:
        plant.close(gain)
    assert error.value.where == "close"


def test_controller_of_two_actuators_is_refused(plant: GeneralisedPlant) -> None:
    with pytest.raises(InputError):
        plant.close(control.ss([], [], [], np.ones((2, 2)), inputs=SENSORS, outputs=2))


def test_sampled_controller_on_a_continuous_plant_is_refused(plant: GeneralisedPlant) -> None:
    sampled = control.StateSpace(
        [[0.5]], [[1.0, 0.0]], [[-1.0]], [[0.0, 0.0]], 0.01, inputs=SENSORS, outputs=["torque"]
    )
    with pytest.raises(InputError):
        plant.close(sampled)


def test_transfer_function_controller_is_refused(plant: GeneralisedPlant) -> None:
    """Its state space is taken; a matrix of transfer functions has none of least order."""
    controller = control.tf(
        [[[1.0], [1.0]]], [[[1.0, 1.0], [1.0, 1.0]]], inputs=SENSORS, outputs=["torque"]
    )
    with pytest.raises(InputError, match=r"TransferFunction.* is not a continuous-time StateSpace"):
        plant.close(controller)
    K = control.ss(
        [[-1.0]], [[1.0, 1.0]], [[1.0]], [[0.0, 0.0]], inputs=SENSORS, outputs=["torque"]
    )
    s = 0.7j
    np.testing.assert_allclose(K(s), controller(s), rtol=1e-14)
    assert plant.close(K).nstates == plant.system.nstates + 1


def general(seed: int, dt: float = 0.0) -> GeneralisedPlant:
    """A plant with every block of D filled, and poles on both sides."""
    rng = np.random.default_rng(seed)
    system = control.StateSpace(
        *(rng.normal(size=shape) for shape in ((3, 3), (3, 4), (4, 3), (4, 4))), dt,
        inputs=["w0", "w1", "w2", "u"], outputs=["z0", "z1", "y0", "y1"],
    )  # fmt: skip
    return GeneralisedPlant(system, ("y0", "y1"))


@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.1]))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_close_takes_every_block_and_the_clock(seed: int, dt: float) -> None:
    """Against python-control's own LFT, and against the algebra of its frequency response."""
    plant = general(seed, dt)
    rng = np.random.default_rng(seed + 1)
    shapes = ((2, 2), (2, 2), (1, 2), (1, 2))
    K = control.StateSpace(
        *(rng.normal(size=shape) for shape in shapes), dt, inputs=["y0", "y1"], outputs=["u"]
    )
    closed = plant.close(K)
    expected = plant.system.lft(control.StateSpace(K.A, K.B, K.C, K.D, dt), 1, 2)
    condition = 1 / abs(1 - float((np.asarray(K.D) @ plant.D22)[0, 0]))
    for name in "ABCD":
        value = np.asarray(getattr(expected, name))
        assert_allclose(getattr(closed, name), value, rtol=0, atol=1e-12 * (1 + condition) ** 2)
    assert closed.dt == plant.system.dt
    s = np.exp(0.7j) if dt else 0.7j
    P, k = plant.system(s), K(s)
    loop = P[:2, :3] + P[:2, 3:] @ k @ np.linalg.solve(np.eye(2) - P[2:, 3:] @ k, P[2:, :3])
    assert_allclose(closed(s), loop, rtol=0, atol=1e-8 * (1 + condition) * np.abs(loop).max())


def test_a_loop_without_delay_and_without_solution_is_refused() -> None:
    plant = general(0)
    gain = np.zeros((1, 2))
    gain[0, 0] = 1 / plant.D22[0, 0]
    static = control.ss([], [], [], gain, inputs=["y0", "y1"], outputs=["u"])
    with pytest.raises(InputError, match="has no solution"):
        plant.close(static)
    plant.close(control.ss([], [], [], gain * (1 + 1e-9), inputs=["y0", "y1"], outputs=["u"]))


def test_a_controller_on_another_clock_is_refused() -> None:
    plant = general(0, 0.1)
    for dt in (0.0, 0.2):
        static = control.StateSpace(
            [[0.5]], [[1, 0]], [[1.0]], [[0, 0]], dt, inputs=["y0", "y1"], outputs=["u"]
        )
        with pytest.raises(InputError, match=r"0\.1 s sampled"):
            plant.close(static)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sensors": ("z0",)}, "not the last outputs"),
        ({"sensors": ("y1", "y0")}, "not the last outputs"),
        ({"sensors": ()}, "not the last outputs"),
        ({"sensors": ("z0", "z1", "y0", "y1")}, "no performance output"),
        ({"system": None}, "is not a StateSpace"),
        ({"system": control.tf([1], [1, 1])}, "is not a StateSpace"),
        ({"system": control.rss(2, 4, 4, dt=True)}, "sample time is not known"),
    ],
)
def test_what_is_no_plant_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(general(0), **change)


def test_numbers_that_are_none_are_refused() -> None:
    broken = general(0).system
    A = np.array(broken.A)
    A[0, 0] = np.inf
    system = control.StateSpace(A, broken.B, broken.C, broken.D, inputs=broken.input_labels,
                                outputs=broken.output_labels)  # fmt: skip
    with pytest.raises(InputError, match="not finite"):
        GeneralisedPlant(system, ("y0", "y1"))
