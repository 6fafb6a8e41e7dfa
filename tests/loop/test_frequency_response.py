"""Evaluation over frequency against python-control, direct solves and a closed form."""

from __future__ import annotations

import control
import numpy as np
import pytest
from brute_force import loop_function
from loop_examples import TWO_SENSORS, loop_on, stable_loop, uniform_arm

from slewctl.loop import FrequencyResponse


@pytest.mark.parametrize("modes", [3, 10, 25])
def test_equals_the_closed_form(modes: int) -> None:
    loop = loop_on(uniform_arm(), TWO_SENSORS, modes)
    omega = np.geomspace(1e-2, 1e5, 400)
    exact = loop_function(loop)(omega)
    A = np.asarray(loop.return_ratio.A)
    # A backward-stable evaluation moves poles by ε‖A‖; the nearest is a half-width away.
    distance = np.abs(1j * omega[:, None] - np.linalg.eigvals(A)).min(axis=1)
    tolerance = 100 * np.finfo(float).eps * np.abs(np.linalg.eigvals(A)).max() / distance
    error = np.abs(loop.response(omega) - exact) / np.abs(exact)
    # Between the poles, cancellation of the modes against each other costs six digits at most.
    assert np.all(error < np.maximum(1e-10, tolerance))


def test_equals_python_control_and_direct_solves() -> None:
    system = stable_loop().return_ratio
    omega = np.geomspace(0.1, 1e3, 60)
    ours = FrequencyResponse(system)(omega)
    eye = np.eye(system.nstates)
    direct = [(system.C @ np.linalg.solve(1j * w * eye - system.A, system.B))[0, 0] for w in omega]
    np.testing.assert_allclose(ours, direct, rtol=1e-8)
    np.testing.assert_allclose(ours, system(1j * omega), rtol=1e-8)


def test_feedthrough_is_added() -> None:
    lag = FrequencyResponse(control.StateSpace(-2.0, 1.0, 6.0, 5.0))
    np.testing.assert_allclose(lag(np.array([0.0, 2.0])), [8.0, 5 + 6 / (2 + 2j)], rtol=1e-15)


def test_infinite_at_poles_on_the_axis() -> None:
    double = FrequencyResponse(control.StateSpace([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], 0))
    assert np.isinf(double(np.array([0.0]))[0])
    assert double(np.array([2.0]))[0] == pytest.approx(-0.25)
    resonant = FrequencyResponse(control.StateSpace([[0, 4], [-4, 0]], [[0], [1]], [[1, 0]], 0))
    assert abs(resonant(np.array([4.0]))[0]) > 1e14


def test_poles_are_those_of_the_matrix() -> None:
    system = stable_loop().return_ratio
    ours, theirs = FrequencyResponse(system).poles, np.linalg.eigvals(system.A)
    gap = np.abs(ours[:, None] - theirs).min(axis=1)
    # A double pole at the origin is known to √ε‖A‖ at worst; here balancing keeps it exact.
    assert gap.max() < 1e-9 * np.abs(theirs).max()


def test_conjugate_symmetry() -> None:
    loop = stable_loop()
    omega = np.array([0.3, 3.0, 30.0])
    np.testing.assert_allclose(loop.response(-omega), loop.response(omega).conj(), rtol=1e-10)
