"""Shapers: zeros, their order, the residual by closed form and by simulation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from slewctl.errors import InputError
from slewctl.trajectory.profiles import MinimumJerk
from slewctl.trajectory.shapers import SHAPERS, Mode, Shaper, compare_shapers, shaper

RATIOS = st.floats(0.0, 0.2)
FREQUENCIES = st.floats(0.1, 1e3)


def simulated(found: Shaper, mode: Mode) -> float:
    """Return the residual of impulses by exact steps of the mode's state."""
    w, a = mode.frequency, np.array([[0, mode.frequency], [-mode.frequency, 0]])
    a[1, 1] = -2 * mode.ratio * w
    state, last = np.zeros(2), 0.0
    for t, amplitude in zip(found.times, found.amplitudes, strict=True):
        state = expm(a * (t - last)) @ state + [0.0, amplitude]
        last = t
    # The envelope of x = e^{-ζωt}(c cos + s sin) now, against that of one unit impulse.
    s = (state[1] + mode.ratio * state[0]) / np.sqrt(1 - mode.ratio**2)
    return float(np.hypot(state[0], s) * np.sqrt(1 - mode.ratio**2))


@pytest.mark.parametrize("kind", SHAPERS)
@given(frequency=FREQUENCIES, ratio=RATIOS)
def test_impulses_sum_to_one_and_leave_what_they_should(
    kind: str, frequency: float, ratio: float
) -> None:
    mode = Mode(frequency, ratio)
    allowed = 0.02
    found = shaper(kind, mode, allowed) if kind.startswith("ei") else shaper(kind, mode)
    assert sum(found.amplitudes) == pytest.approx(1, abs=1e-14)
    assert min(found.amplitudes) > 0
    left = found.residual(frequency, ratio)
    wanted = allowed if kind in ("ei", "ei3") else 0.0
    assert left == pytest.approx(wanted, abs=1e-12)
    off = Mode(1.13 * frequency, ratio)
    closed = found.residual(off.frequency, ratio)
    assert simulated(found, off) == pytest.approx(float(closed), abs=1e-11)


@pytest.mark.parametrize(("kind", "order"), [("zv", 1), ("mzv", 1), ("zvd", 2)])
@pytest.mark.parametrize("ratio", [0.0, 0.1])
def test_order_of_flatness(kind: str, order: int, ratio: float) -> None:
    found = shaper(kind, Mode(5.0, ratio))
    steps = np.array([1e-3, 1e-4])
    left = found.residual(5.0 * (1 + steps), ratio)
    assert np.log10(left[0] / left[1]) == pytest.approx(order, abs=0.01)


@pytest.mark.parametrize("kind", ["ei", "ei2", "ei3"])
def test_humps_of_undamped_shapers_reach_the_tolerance_and_no_more(kind: str) -> None:
    left = shaper(kind, Mode(1.0), 0.05).residual(np.linspace(0.5, 1.5, 20001))
    band = left <= 0.05 * (1 + 1e-9)
    inside = np.flatnonzero(~band)
    low, high = inside[inside < 10000].max(), inside[inside > 10000].min()
    # The best impulses half a period apart are Dolph's: V |T_n(x cos(πr/2))| with T_n(x) = 1/V.
    order = {"ei": 2, "ei2": 3, "ei3": 4}[kind]
    edge = 1 / np.cosh(np.arccosh(1 / 0.05) / order)
    assert (high - low) * 5e-5 == pytest.approx(2 - 4 / np.pi * np.arccos(edge), abs=2e-4)
    inner = left[low + 1 : high]
    humps = inner[1:-1][(inner[1:-1] >= inner[:-2]) & (inner[1:-1] >= inner[2:])]
    np.testing.assert_allclose(humps, 0.05, rtol=1e-4)


@given(st.floats(1e-3, 1e3), RATIOS, st.sampled_from(SHAPERS))
def test_time_scales(scale: float, ratio: float, kind: str) -> None:
    allowed = (0.02,) if kind.startswith("ei") else ()
    slow, fast = (shaper(kind, Mode(w, ratio), *allowed) for w in (3.0, 3.0 * scale))
    np.testing.assert_allclose(np.array(fast.times) * scale, slow.times, rtol=1e-12)
    np.testing.assert_allclose(fast.amplitudes, slow.amplitudes, rtol=1e-11)


def test_several_modes_by_convolution() -> None:
    modes = [Mode(5.0, 0.01), Mode(31.0, 0.02)]
    both = shaper("zvd", modes)
    assert both.duration == pytest.approx(sum(shaper("zvd", m).duration for m in modes))
    assert len(both.times) == 9
    left = [float(both.residual(m.frequency, m.ratio)) for m in modes]
    np.testing.assert_allclose(left, 0.0, atol=1e-13)
    # Impulses that fall together are one: a ZVD is the square of a ZV.
    square = shaper("zv", modes[0]).convolved(shaper("zv", modes[0]))
    once = shaper("zvd", modes[0])
    np.testing.assert_allclose(square.times, once.times, rtol=1e-13)
    np.testing.assert_allclose(square.amplitudes, once.amplitudes, rtol=1e-13)


def test_a_shaped_command_ends_later_and_keeps_its_derivatives() -> None:
    found, turn = shaper("zvd", Mode(5.0, 0.01)), MinimumJerk(0.5, 1.0)
    end = turn.duration + found.duration
    angle, _, _ = found.command(turn, np.array([0.0, end]))
    np.testing.assert_allclose(angle, [0.0, 0.5], atol=1e-15)
    t = np.linspace(0, end, 7)[1:-1]
    ahead, behind = (found.command(turn, t + h)[0] for h in (1e-5, -1e-5))
    np.testing.assert_allclose((ahead - behind) / 2e-5, found.command(turn, t)[1], atol=1e-8)


def test_table_tells_robustness_and_its_price() -> None:
    modes = [Mode(5.0), Mode(31.0, 0.01)]
    table = compare_shapers([shaper(k, modes) for k in ("zv", "zvd", "ei")], modes)
    zv, zvd, ei = table.entries
    assert zv.duration < zvd.duration == pytest.approx(ei.duration)
    assert zv.residual_off > zvd.residual_off > 0
    assert [row["shaper"] for row in table.rows()] == ["zv", "zvd", "ei"]


def test_what_cannot_be_shaped_is_refused() -> None:
    with pytest.raises(InputError, match=r"more than 1\.25664 s"):
        shaper("zvd", Mode(5.0)).require_within(1.2)
    shaper("zvd", Mode(5.0)).require_within(1.2567)
    for make in (
        lambda: Mode(1.0, 1.0),
        lambda: shaper("zvv", Mode(1.0)),
        lambda: shaper("zv", []),
        lambda: shaper("zv", Mode(1.0), 0.02),
        lambda: compare_shapers([shaper("zv", Mode(1.0))], []),
        lambda: compare_shapers(["zv"], [Mode(1.0)]),  # type: ignore[list-item]
        lambda: compare_shapers(shaper("zv", Mode(1.0)), [Mode(1.0)]),  # type: ignore[arg-type]
        lambda: shaper("ei", Mode(1.0, 0.9)),
        lambda: shaper("ei", Mode(1.0), 1.0),
    ):
        with pytest.raises(InputError):
            make()
