"""Roots of the characteristic equations against mpmath in hundreds of digits."""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest
from precise_shapes import root

from slewctl import InputError
from slewctl.basis.characteristic import Roots, clamped_free_roots, slewing_roots

N = 200
KINDS = [("clamped-free", clamped_free_roots), ("slewing", slewing_roots)]


@pytest.mark.parametrize(("name", "roots"), KINDS)
def test_roots_are_correct_to_two_units_in_the_last_place(
    name: str, roots: Callable[[int], Roots]
) -> None:
    """Rounding π, the multiple of it and the sum with the correction: 1.5 units at most."""
    z = roots(N).z
    error = [abs(float(z[i] - root(name, i + 1))) for i in range(N)]
    assert np.all(np.array(error) <= 2 * np.spacing(z))


@pytest.mark.parametrize(("name", "roots"), KINDS)
def test_sine_and_cosine_at_the_root_keep_relative_accuracy(
    name: str, roots: Callable[[int], Roots]
) -> None:
    """cos z = −sech z is 1e-272 at the 200th root; e^(−z) in doubles carries z·ε/2 and a unit."""
    values = roots(N)
    for i, (z, sine, cosine) in enumerate(zip(values.z, values.sin, values.cos, strict=True)):
        exact = root(name, i + 1)
        with mp.workdps(40 + int(z)):
            for computed, truth in ((sine, mp.sin(exact)), (cosine, mp.cos(exact))):
                assert abs(mp.mpf(computed) / truth - 1) <= (z + 4) * np.finfo(float).eps


@pytest.mark.parametrize(("name", "roots"), KINDS)
def test_roots_are_all_roots_and_increase_by_pi(name: str, roots: Callable[[int], Roots]) -> None:
    """The equation divided by cosh changes sign exactly n times below the last root plus π/2."""
    z = roots(40).z
    x = np.linspace(0.1, z[-1] + np.pi / 2, 200_000)
    residual = (
        np.cos(x) + 1 / np.cosh(x) if name == "clamped-free" else np.sin(x) - np.cos(x) * np.tanh(x)
    )
    crossings = x[1:][np.diff(np.sign(residual)) != 0]
    assert len(crossings) == 40
    assert np.all(np.abs(crossings - z) <= x[1] - x[0])


@pytest.mark.parametrize(("name", "roots"), KINDS)
def test_roots_do_not_overflow_far_out(name: str, roots: Callable[[int], Roots]) -> None:
    values = roots(400)
    assert np.all(np.diff(values.z) > 0)
    assert np.allclose(values.sin**2 + values.cos**2, 1, rtol=0, atol=4e-16)


@pytest.mark.parametrize(("name", "roots"), KINDS)
@pytest.mark.parametrize("n", [0, -1, 2.0, 1.5, True, "3", None, np.nan])
def test_impossible_numbers_of_roots_are_refused(
    name: str, roots: Callable[[int], Roots], n: object
) -> None:
    with pytest.raises(InputError, match="whole number >= 1"):
        roots(n)
