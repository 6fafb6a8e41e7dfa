"""Peaks and the margins that come from them, against closed forms and dense evaluation."""

from __future__ import annotations

import control
import numpy as np
import pytest
from random_loops import stable_loops

from slewctl.loop import Loop, classical_margins
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.given_system import static
from slewctl.numerics.hinf_norm import PEAK_TOLERANCE, peak_gain


@pytest.mark.parametrize("zeta", [1e-6, 1e-4, 0.02, 0.3])
def test_peak_of_an_oscillator_is_known(zeta: float) -> None:
    """max |1/(s² + 2ζs + 1)| = 1/(2ζ√(1 − ζ²)) at ω = √(1 − 2ζ²)."""
    peak = peak_gain(control.ss([[0, 1], [-1, -2 * zeta]], [[0], [1]], [[1, 0]], 0))
    assert peak.value == pytest.approx(1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=PEAK_TOLERANCE)
    assert peak.omega == pytest.approx(np.sqrt(1 - 2 * zeta**2), rel=max(1e-4 * zeta, 1e-9))


def test_peak_at_zero_and_at_infinity() -> None:
    low = peak_gain(control.ss(-1.0, 1.0, 3.0, 0.0))
    assert (low.value, low.omega) == (pytest.approx(3.0), 0.0)
    high = peak_gain(control.ss(-1.0, 1.0, -0.5, 1.0))  # (s + ½)/(s + 1)
    assert (high.value, high.omega) == (pytest.approx(1.0), np.inf)


@pytest.mark.slow
@pytest.mark.parametrize("inputs", [1, 2, 3])
@pytest.mark.parametrize("step", [0, 0.05])
def test_no_grid_finds_a_higher_singular_value(inputs: int, step: float) -> None:
    """Random lightly damped systems with feedthrough, two outputs, continuous and sampled."""
    rng = np.random.default_rng(inputs)
    for _ in range(6):
        blocks = [_block(w) for w in np.sort(rng.uniform(0.5, 40, 5))]
        A = np.kron(np.eye(5), np.zeros((2, 2)))
        for i, block in enumerate(blocks):
            A[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = block
        B, C = rng.standard_normal((10, inputs)), rng.standard_normal((2, 10))
        system = control.StateSpace(A, B, C, 0.3 * rng.standard_normal((2, inputs)))
        system = system.sample(step) if step else system
        peak = peak_gain(system)
        response = FrequencyResponse(system)
        around = response.landmarks[:, None] * (1 + 1e-3 * np.linspace(-4, 4, 801))
        top = np.pi / step if step else 1e4
        omega = np.concatenate([np.geomspace(1e-3, top, 3000), around.ravel()])
        values = response(omega[omega <= top]).reshape(-1, 2, inputs)
        highest = np.linalg.norm(values, 2, axis=(1, 2)).max()
        assert highest <= peak.value * (1 + 2 * PEAK_TOLERANCE)
        assert highest == pytest.approx(peak.value, rel=1e-4)
        at = np.atleast_3d(response(np.array([peak.omega]))).reshape(2, inputs)
        assert np.linalg.norm(at, 2) == pytest.approx(peak.value, rel=1e-12)


def _block(w: float) -> np.ndarray:
    return np.array([[0, w], [-w, -2e-3 * w]])


def test_peak_is_that_of_the_transpose_and_of_the_inverse_scale() -> None:
    rng = np.random.default_rng(5)
    A = rng.standard_normal((6, 6)) - 4 * np.eye(6)
    B, C, D = rng.standard_normal((6, 2)), rng.standard_normal((3, 6)), rng.standard_normal((3, 2))
    peak = peak_gain(control.StateSpace(A, B, C, D))
    turned = peak_gain(control.StateSpace(A.T, C.T, B.T, D.T))
    faster = peak_gain(control.StateSpace(1e5 * A, 1e5 * B, C, D))
    assert turned.value == pytest.approx(peak.value, rel=2 * PEAK_TOLERANCE)
    assert faster.value == pytest.approx(peak.value, rel=2 * PEAK_TOLERANCE)
    assert faster.omega == pytest.approx(1e5 * peak.omega, rel=1e-3)


def test_sampled_peak_survives_damping_below_the_grid_of_z() -> None:
    """ζωT = 1e-7: the pole lies a ten-millionth inside the unit circle, the norm is finite."""
    zeta, T = 1e-5, 0.01
    lag = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * T)
    A = [[2 * lag.real, -(abs(lag) ** 2)], [1, 0]]
    peak = peak_gain(control.StateSpace(A, [[1], [0]], [[0, 1]], 0, T))
    theta = np.linspace(-3, 3, 20001) * zeta * T + np.angle(lag)
    z = np.exp(1j * theta)
    highest = np.abs(1 / ((z - lag) * (z - np.conj(lag)))).max()
    # The data of A carry ε, against ζωT that is 1e-9.
    assert peak.value == pytest.approx(highest, rel=1e-7)


def test_static_and_flat_systems() -> None:
    gains = peak_gain(static(np.array([3.0, 4.0])))
    assert gains.value == pytest.approx(5.0)
    all_pass = peak_gain(control.ss(control.tf([-1, 2], [1, 2])))
    assert all_pass.value == pytest.approx(1.0, rel=PEAK_TOLERANCE)
    assert peak_gain(control.StateSpace(-1.0, 0.0, 0.0, 0.0)).value == 0.0


def test_double_integrator_with_pd_has_modulus_margin_one() -> None:
    """L = (s + 1)/s²: |1 + L| ≥ 1 at all frequencies, reached at infinity."""
    m = classical_margins(control.ss([[0, 1], [0, 0]], [[0], [1]], [[1, 1.5]], 0))
    assert m.modulus.value == pytest.approx(1.0, rel=2 * PEAK_TOLERANCE)


@pytest.mark.parametrize("loop", list(stable_loops(7, 12)))
def test_no_dense_grid_finds_a_higher_peak(loop: Loop) -> None:
    """No grid comes nearer to −1, and the disk promises no more than gain and phase margins."""
    L, m = loop.return_ratio, loop.margins
    poles = np.linalg.eigvals(np.asarray(loop.system.A))
    around = poles.imag[:, None] + np.abs(poles.real)[:, None] * np.linspace(-4, 4, 41)
    omega = np.concatenate([np.geomspace(1e-3, 1e5, 2000), around.ravel()])
    values = FrequencyResponse(L)(omega[omega > 0])
    # Schur evaluation of L near a resonance, relative to 1 + L, keeps ten digits.
    assert np.abs(1 + values).min() >= m.modulus.value * (1 - 1e-7)
    assert (2 * np.abs((1 + values) / (1 - values))).min() >= m.disk.value * (1 - 1e-7)
    # Gain and phase margins are points of the disk, and the disk must not promise more.
    alpha = m.disk.value
    if alpha < 2:
        assert m.gain_db.value >= 20 * np.log10((2 + alpha) / (2 - alpha)) * (1 - 1e-6)
    assert m.phase_deg.value >= 2 * np.degrees(np.arctan(alpha / 2)) * (1 - 1e-6)
