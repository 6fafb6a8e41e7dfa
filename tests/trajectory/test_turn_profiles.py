"""Profiles: rest to rest, exact derivatives, within their limits, and the fastest of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson

from slewctl.errors import InputError
from slewctl.trajectory.profiles import MinimumJerk, Profile, RigidTimeOptimal, SCurve, Versine

PROFILES = [
    MinimumJerk(0.7, 1.3),
    Versine(-0.7, 1.3),
    SCurve(2.0, 1.0, 3.0),
    SCurve(-0.2, 1.0, 3.0),
    SCurve(2.0, 1.0, 3.0, 20.0),
    SCurve(2.0, 1.0, 3.0, 2.0),
    SCurve(0.4, 1.0, 3.0, 20.0),
    SCurve(0.01, 1.0, 3.0, 20.0),
    RigidTimeOptimal(1.2, 0.5, 0.3),
    RigidTimeOptimal(-1.2, 0.5, 0.3, 0.4),
    RigidTimeOptimal(1.2, 0.5, 0.3, 1e-9),
]


@pytest.mark.parametrize("profile", PROFILES, ids=str)
def test_from_rest_to_rest_with_exact_derivatives(profile: Profile) -> None:
    end = profile.duration
    angle, rate, _ = profile.at(np.array([-1.0, 0.0, end, end + 1.0]))
    size = abs(profile.angle)
    np.testing.assert_allclose(angle, profile.angle * np.array([0, 0, 1, 1]), atol=1e-14 * size)
    np.testing.assert_allclose(rate, 0.0, atol=1e-14 * size / end)
    t = np.linspace(0.0, end, 40001)
    angle, rate, acceleration = profile.at(t)
    moved = cumulative_simpson(rate, x=t, initial=0)
    np.testing.assert_allclose(moved, angle, atol=1e-8 * size)
    sped = np.append(0, np.cumsum((acceleration[1:] + acceleration[:-1]) * (t[1] - t[0]) / 2))
    np.testing.assert_allclose(sped, rate, atol=3e-4 * size / end)


@given(*[st.floats(0.05, 20.0)] * 4)
def test_s_curve_keeps_its_limits_and_uses_one_of_them_always(
    angle: float, v: float, a: float, j: float
) -> None:
    curve = SCurve(angle, v, a, j)
    first, second, third = curve.widths
    assert first >= second + third - 1e-12 * first
    assert second >= third * (1 - 1e-12)
    peaks = np.array([angle / first, angle / first / second, angle / first / second / third])
    assert np.all(peaks <= np.array([v, a, j]) * (1 + 1e-9))
    # The jerk is at its limit, and between that and the acceleration's nothing else is left.
    assert peaks[2] == pytest.approx(j, rel=1e-9)
    assert second == pytest.approx(third, rel=1e-9) or peaks[1] == pytest.approx(a, rel=1e-9)
    resting = first <= (second + third) * (1 + 1e-12)
    assert resting or peaks[0] == pytest.approx(v, rel=1e-9)


@given(st.floats(0.0, 30.0), st.floats(0.1, 5.0))
@example(3.0, 4.875)  # 1 - s is all but zero
@example(3.284618104176829e-158, 1.0)  # its square is a denormal number
def test_bang_bang_obeys_the_rigid_arm(friction: float, angle: float) -> None:
    profile = RigidTimeOptimal(angle, 2.0, 0.8, friction)
    t = np.linspace(0, profile.duration, 30)
    _, rate, acceleration = profile.at(t)
    torque = 0.8 * acceleration + friction * rate
    np.testing.assert_allclose(np.abs(torque), 2.0, rtol=1e-12)
    driving, braking = profile.phases
    # The impulse of the torque is what the friction took.
    assert 2.0 * (driving - braking) == pytest.approx(friction * angle, rel=1e-9, abs=1e-12)
    end, last, _ = profile.at(np.array([profile.duration]))
    assert end[0] == pytest.approx(angle, rel=1e-9)
    assert last[0] == pytest.approx(0.0, abs=1e-9 * angle)


@pytest.mark.parametrize(
    "limits", [(6.28, 7.3e-5, 0.1, 10.0), (6.28, 1e-3, 10.0, 1e4), (-1.57, 0.5, 100.0, 1e5)]
)
def test_a_long_cruise_is_at_the_full_rate_and_no_more(limits: tuple[float, ...]) -> None:
    """Ramps of milliseconds in a turn of a day: no sum of large powers is left in it."""
    turn = SCurve(*limits)
    t = np.unique(np.concatenate([np.linspace(0, turn.duration, 5001), turn.kinks]))
    angle, rate, _ = turn.at(t)
    assert np.abs(rate).max() == pytest.approx(limits[1], rel=1e-12)
    np.testing.assert_array_less(0, np.diff(np.abs(angle)))
    middle = np.abs(t - turn.duration / 2) < turn.duration / 4
    line = limits[0] / 2 + np.sign(limits[0]) * limits[1] * (t[middle] - turn.duration / 2)
    np.testing.assert_allclose(angle[middle], line, rtol=1e-12)


def test_without_a_jerk_limit_and_a_rate_limit_the_s_curve_is_the_bang_bang() -> None:
    ends = [SCurve(1.2, 1e3, 0.5 / 0.3).duration, RigidTimeOptimal(1.2, 0.5, 0.3).duration]
    assert ends[0] == pytest.approx(ends[1], rel=1e-13)
    assert SCurve(1.2, 1e3, 0.5 / 0.3, 1e9).duration == pytest.approx(ends[0], rel=1e-6)


@pytest.mark.parametrize("kind", [MinimumJerk, Versine])
def test_too_fast_a_turn_is_told_the_time_that_works(kind: type[MinimumJerk | Versine]) -> None:
    turn = kind(0.7, 0.3)
    found = np.abs(turn.at(np.linspace(0, 0.3, 20001))[2]).max()
    assert turn.peak_acceleration == pytest.approx(found, rel=1e-7)
    with pytest.raises(InputError, match="take at least") as caught:
        turn.require_torque(2.0, 4.0)
    least = float(caught.value.remedy.split()[-2])
    kind(0.7, least).require_torque(2.0, 4.0)
    with pytest.raises(InputError):
        kind(0.7, least * 0.9999).require_torque(2.0, 4.0)


@pytest.mark.parametrize("make", [lambda: SCurve(0.0, 1, 1), lambda: RigidTimeOptimal(1, 1, -1)])
def test_impossible_turns_are_refused(make: object) -> None:
    with pytest.raises(InputError):
        make()  # type: ignore[operator]
