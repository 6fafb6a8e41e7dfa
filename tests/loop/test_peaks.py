"""Peaks and the margins that come from them, against closed forms and dense evaluation."""

from __future__ import annotations

import control
import numpy as np
import pytest
from random_loops import stable_loops

from slewctl.loop import Loop, classical_margins
from slewctl.loop.frequency import FrequencyResponse
from slewctl.loop.peaks import PEAK_TOLERANCE, peak_gain


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


def test_l_infinity_norm_of_the_slicot_example() -> None:
    """SLICOT AB13DD's own example: 0.5000000001e6 at 1.414213562 rad/s."""
    eps = 1e-6  # damping of the narrow mode, of which the peak is the half-inverse
    peak = peak_gain(control.ss([[0, 1], [-2, -2 * eps]], [[0], [1]], [[0, 1]], 0))
    assert peak.value == pytest.approx(1 / (2 * eps), rel=PEAK_TOLERANCE)
    assert peak.omega == pytest.approx(np.sqrt(2), rel=1e-9)


def test_disk_margin_of_seiler_packard_gahinet() -> None:
    """L = 25/(s³ + 10s² + 10s + 10): α = 0.458093 at 1.955 rad/s, gains [0.627278, 1.594189]."""
    m = classical_margins(control.tf2ss(control.tf([25], [1, 10, 10, 10])))
    alpha = m.disk.value
    assert alpha == pytest.approx(0.458093, abs=6e-7)
    assert m.disk.frequency_hz is not None
    assert 2 * np.pi * m.disk.frequency_hz == pytest.approx(1.955, abs=6e-4)
    assert (2 - alpha) / (2 + alpha) == pytest.approx(0.627278, abs=6e-7)
    assert (2 + alpha) / (2 - alpha) == pytest.approx(1.594189, abs=6e-7)
    assert 2 * np.degrees(np.arctan(alpha / 2)) == pytest.approx(25.80, abs=6e-3)


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
