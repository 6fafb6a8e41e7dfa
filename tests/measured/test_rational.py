"""Rational fits: functions given back from their values, through noise, on a clock, in any unit."""

from __future__ import annotations

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc
from slewctl.measured.response_data import rig_response
from slewctl.measured.rig_model import Channel, Modes
from slewctl.measured.rig_parameters import Rig

ARM = sc.Arm(sc.Beam(0.6, 0.4, 0.5), sc.Hub(0.01, friction=0.01), damping_ratio=0.005)
HZ = np.linspace(0.2, 45.0, 250)


def random_function(
    seed: int, pairs: int, at_zero: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return poles of light pairs within 0.5 to 30 Hz, residues, and 1/s^k's coefficients."""
    rng = np.random.default_rng(seed)
    hz = np.sort(rng.uniform(0.5, 30.0, pairs)) * 2 * np.pi
    poles = hz * (1j - rng.uniform(0.003, 0.1, pairs))
    residues = hz * (rng.normal(size=pairs) + 1j * rng.normal(size=pairs))
    return poles, residues, hz[0] * rng.uniform(1.0, 2.0, at_zero)


def values_of(
    poles: np.ndarray, residues: np.ndarray, rigid: np.ndarray, s: np.ndarray
) -> np.ndarray:
    pairs = residues / (s[:, None] - poles) + residues.conj() / (s[:, None] - poles.conj())
    return pairs.sum(axis=1) + sum(c / s**m for m, c in enumerate(rigid, 1))


@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(0, 2))
@settings(max_examples=15, deadline=None)
def test_a_rational_function_is_given_back_in_any_unit(seed: int, pairs: int, at_zero: int) -> None:
    poles, residues, rigid = random_function(seed, pairs, at_zero)
    hz = np.linspace(0.3, 40.0, 200)
    values = values_of(poles, residues, rigid, 2j * np.pi * hz)
    order = 2 * pairs + at_zero
    expected = np.sort_complex(np.concatenate([poles, poles.conj(), np.zeros(at_zero)]))
    for time, gain in ((1.0, 1.0), (1e3, 1e-6)):
        measured = sc.Response(hz / time, gain * values)
        found = sc.fit_rational(measured, order, poles_at_zero=at_zero)
        assert (found.order, found.stable) == (order, True)
        assert found.largest_error < 1e-6
        np.testing.assert_allclose(
            np.sort_complex(found.poles) * time, expected, rtol=1e-5, atol=1e-6 * abs(poles).max()
        )
        system = found.system
        assert isinstance(system, ct.StateSpace)
        assert (system.input_labels, system.output_labels) == (["torque"], ["theta"])
        np.testing.assert_allclose(system(1j * measured.omega), gain * values, rtol=1e-5)


def test_on_a_clock_it_is_the_sampled_arm() -> None:
    step = 0.01
    values = rig_response(Rig(ARM), Channel("torque", "tip", step), Modes(4), 2 * np.pi * HZ)
    found = sc.fit_rational(
        sc.Response(HZ, values, sample_time=step, sensor="tip"), 10, poles_at_zero=1
    )
    assert found.system.dt == step
    assert found.stable
    np.testing.assert_allclose(found.system(np.exp(2j * np.pi * HZ * step)), values, rtol=1e-5)
    model = sc.state_space(sc.assemble(ARM, "clamped-free", 1), ["tip"])
    assert found.system.output_labels == model.output_labels


def test_noise_is_neither_fitted_nor_does_it_move_the_poles() -> None:
    # Three modes, and the rigid body with its friction: seven poles beside the one at zero.
    modes = Modes(3)
    rng = np.random.default_rng(1)
    deviation = 0.02
    exact = rig_response(Rig(ARM), Channel("torque", "theta"), modes, 2 * np.pi * HZ)
    noise = rng.normal(size=len(HZ)) + 1j * rng.normal(size=len(HZ))
    values = exact * (1 + deviation * noise)
    measured = sc.Response(HZ, values, np.full(len(HZ), deviation))
    found = sc.fit_rational(measured, poles_at_zero=1)
    assert found.order == 8
    assert found.scatter == pytest.approx(1.0, abs=0.1)
    assert found.relative_error == pytest.approx(np.sqrt(2) * deviation, rel=0.2)
    # The noise of 250 points is averaged over 16 coefficients.
    off = np.abs(found.system(2j * np.pi * HZ) / exact - 1)
    assert np.sqrt(np.mean(off**2)) == pytest.approx(deviation * np.sqrt(16 / len(HZ)), rel=0.5)
    hz = np.sort(np.abs(found.poles[found.poles.imag > 1.0])) / (2 * np.pi)
    np.testing.assert_allclose(hz, sc.truth(ARM, 3).frequencies_hz, rtol=2e-3)
    unknown = sc.fit_rational(sc.Response(HZ, values), poles_at_zero=1)
    assert unknown.order == 8
    assert np.isnan(unknown.scatter)
    assert "deviations" not in str(unknown)


def test_an_unstable_pole_is_found_where_it_may_be() -> None:
    hz = np.linspace(0.1, 5.0, 80)
    s = 2j * np.pi * hz
    measured = ct.FrequencyResponseData(1 / ((s - 2) * (s**2 + s + 100)), 2 * np.pi * hz)
    free = sc.fit_rational(measured, 3, stable=False)
    assert not free.stable
    assert np.max(free.poles.real) == pytest.approx(2.0, rel=1e-6)
    assert "NOT stable" in str(free)
    kept = sc.fit_rational(measured, 3)
    assert kept.stable
    assert kept.relative_error > 0.1
    assert np.all(kept.system.poles().real < 0)


def test_impossible_orders_are_refused() -> None:
    measured = sc.Response([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, 1j])
    for order, at_zero in ((1, 2), (4, 0)):
        with pytest.raises(sc.InputError, match="poles for 4 points"):
            sc.fit_rational(measured, order, poles_at_zero=at_zero)
    with pytest.raises(sc.InputError, match=r"fit_rational\.order"):
        sc.fit_rational(measured, 0)
