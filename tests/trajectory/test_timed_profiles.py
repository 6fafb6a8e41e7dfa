"""Profiles by name: as long as asked, from rest to rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc
from slewctl.trajectory.timed_profiles import PROFILES


@given(st.sampled_from(sorted(PROFILES)), st.floats(0.01, 3), st.sampled_from([-1, 1]),
       st.floats(0.01, 100))  # fmt: skip
@settings(deadline=None, max_examples=60, derandomize=True)
def test_they_take_the_time_and_end_at_the_angle(name, size, sign, duration) -> None:
    profile = sc.timed_profile(name, sign * size, duration)
    assert profile.duration == pytest.approx(duration, rel=1e-12)
    t = np.linspace(0, duration, 4001)
    angle, rate, acceleration = profile.at(t)
    assert angle[-1] == pytest.approx(sign * size, rel=1e-12)
    assert abs(angle[0]) < 1e-12 * size
    assert np.all(np.diff(angle) * sign >= -1e-12 * size)
    # The acceleration integrates to the rate; it jumps at kinks alone.
    summed = np.concatenate([[0], np.cumsum((acceleration[1:] + acceleration[:-1]) / 2)])
    assert np.abs(summed * duration / 4000 - rate).max() < 2e-3 * np.abs(rate).max()
    kinks = np.array(profile.kinks)
    assert kinks[0] == 0
    assert kinks[-1] == pytest.approx(duration, rel=1e-12)
    jumps = np.abs(np.diff(acceleration)) > 0.2 * np.abs(acceleration).max()
    for time in t[1:][jumps]:
        assert np.abs(kinks - time).min() < duration / 3999


def test_segments_are_as_they_are_told() -> None:
    trapezoid, curve = (sc.timed_profile(name, 1.0, 7.0) for name in ("trapezoid", "s-curve"))
    assert trapezoid.kinks == pytest.approx((0, 7 / 3, 14 / 3, 7))
    assert curve.kinks == pytest.approx(range(8))


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(sc.InputError, match="versine"):
        sc.timed_profile("versin", 1.0, 1.0)
