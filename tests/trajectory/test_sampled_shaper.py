"""Shapers on a clock: exact there, never longer than the classical ones that fit it."""

from __future__ import annotations

import numpy as np
import pytest

from slewctl.errors import InputError
from slewctl.trajectory.sampled_shaper import sampled_shaper
from slewctl.trajectory.shapers import Mode, shaper


@pytest.mark.parametrize(("order", "kind"), [(1, "zv"), (2, "zvd")])
@pytest.mark.parametrize("ratio", [0.0, 0.05])
def test_on_a_clock_that_fits_it_is_the_classical_one(order: int, kind: str, ratio: float) -> None:
    mode = Mode(5.0, ratio)
    classical = shaper(kind, mode)
    found = sampled_shaper([mode], mode.half_period / 8, order)
    np.testing.assert_allclose(found.times, classical.times, rtol=1e-12)
    np.testing.assert_allclose(found.amplitudes, classical.amplitudes, rtol=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_of_two_modes_it_is_no_longer_than_the_convolution(order: int) -> None:
    step = 0.01
    modes = [Mode(np.pi / 0.4, 0.0), Mode(np.pi / 0.15, 0.0)]
    found = sampled_shaper(modes, step, order)
    assert found.duration <= order * 0.55 + 1e-12
    np.testing.assert_allclose(np.array(found.times) / step, np.rint(np.array(found.times) / step))
    for mode in modes:
        left = found.residual(mode.frequency * (1 + np.array([0.0, 1e-3, 1e-4])))
        assert left[0] < 1e-8
        assert np.log10(left[1] / left[2]) > order - 0.1


def test_off_the_grid_it_is_exact_where_the_rounded_classical_one_is_not() -> None:
    mode, step = Mode(5.0, 0.02), 0.05
    assert float(sampled_shaper([mode], step).residual(5.0, 0.02)) < 1e-8
    near = shaper("zv", mode)
    assert abs(near.times[1] / step - round(near.times[1] / step)) > 0.1


@pytest.mark.parametrize("ratio", [0.0, 0.3])
def test_too_slow_a_clock_is_told_the_time_that_works(ratio: float) -> None:
    mode = Mode(40.0, ratio)
    with pytest.raises(InputError, match="take at most") as caught:
        sampled_shaper([mode], 0.05)
    works = float(caught.value.remedy.split()[-2])
    assert sampled_shaper([mode], works).duration > 0
    for bad in (([], 0.01, 1), ([mode], 0.01, 3)):
        with pytest.raises(InputError):
            sampled_shaper(*bad)
