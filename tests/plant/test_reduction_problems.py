"""Reductions of control problems: names, bounds, units, corrected controllers, and refusals."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from reductions import arm_with, plant_of, response, without

from slewctl import (
    InputError,
    lqg,
    truth,
)
from slewctl.plant import balanced_truncation, modal_truncation, state_space


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
