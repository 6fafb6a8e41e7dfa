"""Shapers over bands of frequencies, by linear programming."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc


@given(st.floats(0.02, 0.25), st.floats(0, 0.1), st.floats(0.02, 0.2))
@settings(deadline=None, max_examples=4, derandomize=True)
def test_nothing_in_the_band_leaves_more(width: float, ratio: float, tolerance: float) -> None:
    band = sc.Band(10 * (1 - width), 10 * (1 + width), ratio)
    found = sc.robust_shaper([band], tolerance=tolerance, sample_time=0.02)
    left = found.residual(np.linspace(band.low, band.high, 2011), ratio)
    assert left.max() <= tolerance
    assert sum(found.amplitudes) == pytest.approx(1)
    assert min(found.amplitudes) > 0
    assert found.times[0] == 0
    np.testing.assert_allclose(np.array(found.times) / 0.02, np.round(np.array(found.times) / 0.02))


@pytest.mark.slow
def test_small_residuals_are_held_and_cost_more_time() -> None:
    """The solver's tolerance is absolute, and far above what is left."""
    band, tolerances = sc.Band(10.0, 14.0), (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    found = [sc.robust_shaper([band], tolerance=tolerance) for tolerance in tolerances]
    for shaper, tolerance in zip(found, tolerances, strict=True):
        left = shaper.residual(np.linspace(band.low, band.high, 20_011))
        assert 0.99 * tolerance < left.max() <= tolerance
    durations = [shaper.duration for shaper in found]
    assert durations == sorted(durations)
    exact = sc.robust_shaper([sc.Band(10.0, 10.0)], tolerance=1e-6)
    assert exact.duration == pytest.approx(sc.shaper("zv", sc.Mode(10.0)).duration)


@pytest.mark.parametrize("kind", ["ei", "ei2", "ei3"])
def test_it_is_no_longer_than_the_classical_one_of_the_same_band(kind: str) -> None:
    classical = sc.shaper(kind, sc.Mode(2 * np.pi))
    T = classical.times[1] / 10  # the classical one's impulses are on the grid
    w = np.linspace(0.3, 1.7, 5001) * 2 * np.pi
    inside = classical.residual(w) <= 0.05 + 1e-9
    middle = len(w) // 2
    low = middle - np.argmin(inside[middle::-1])
    high = middle + np.argmin(inside[middle:])
    found = sc.robust_shaper([sc.Band(w[low + 1], w[high - 1])], tolerance=0.05002, sample_time=T)
    assert found.duration <= classical.duration * (1 + 1e-12)


def test_several_bands_and_a_fits_uncertainty() -> None:
    bands = [sc.Band.around(9.0, 0.3, 0.02), sc.Band.around(31.0, 0.5, 0.01)]
    assert bands[0].low == pytest.approx(8.4)
    found = sc.robust_shaper(bands)
    for band in bands:
        assert found.residual(np.linspace(band.low, band.high, 999), band.ratio).max() <= 0.05


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: sc.robust_shaper([]), "at least one"),
        (lambda: sc.robust_shaper([sc.Band(9, 10)], tolerance=1.0), "tolerance"),
        (lambda: sc.robust_shaper([sc.Band(9, 10)], tolerance=1e-300), "1e-06 <= tolerance"),
        (lambda: sc.robust_shaper([sc.Band(9, 10)], sample_time=0.3), "take at most 0.1569 s"),
        (lambda: sc.Band(10, 9), "lower frequency first"),
        (lambda: sc.Band(9, 10, 1.0), "ratio"),
    ],
)
def test_what_is_no_band_is_refused(call, told: str) -> None:
    with pytest.raises(sc.InputError, match=told):
        call()
