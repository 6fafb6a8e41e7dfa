"""Slow poles that cancel most of each other, and loops of such."""

from __future__ import annotations

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

import slewctl as sc
from slewctl.loop import Crossing
from slewctl.loop.single.factor import factor_of
from slewctl.loop.single.far_poles import far_poles
from slewctl.numerics.linear_system import LinearSystem
from slewctl.testing import assert_margins


@given(st.integers(0, 10_000), st.integers(2, 5))
@settings(max_examples=40, deadline=None)
def test_the_curvature_of_slow_poles_together_is_bounded_closely(seed: int, count: int) -> None:
    # Zeros at about 1 rad/s leave of the residues of slow poles what is far less than each.
    rng = np.random.default_rng(seed)
    poles = -np.sort(10 ** rng.uniform(-4, -3, count))
    zeros = -(10 ** rng.uniform(-0.5, 0.5, count - 1))
    residue = np.array(
        [np.prod(p - zeros) / np.prod(p - np.delete(poles, k)) for k, p in enumerate(poles)]
    )
    sigma = poles.astype(complex)
    form = factor_of(LinearSystem(np.diag(poles), np.ones((count, 1)), residue[None], [[0.0]])).form
    groups = far_poles(sigma, residue[:, None].astype(complex), form, {})
    assert groups
    v = np.geomspace(0.1, 1e4, 200)
    together = np.min([group.curve(v)[:, 0] for group in groups if not len(group.sigma)], axis=0)
    true = np.abs(np.sum(2 * residue / (1j * v[:, None] - sigma) ** 3, axis=1))
    noise = 1e-13 * np.sum(np.abs(2 * residue) / v[:, None] ** 3, axis=1)
    assert np.all(true <= together + noise)
    far = v > 30
    assert np.all(together[far] < 5 * true[far] + 10 * noise[far])
    # Within intervals, others and all, never more than each by itself says.
    each = np.sum(2 * np.abs(residue) / np.abs(0.9j * v[:, None] - sigma) ** 3, axis=1)[:, None]
    lowered = each.copy()
    for group in groups:
        group.lower(lowered, v, 0.1 * v, [])
    assert np.all(lowered <= each)
    assert np.all(true <= lowered[:, 0] + noise)


POLES = ([1e-3, -2e-3, -3e-3], [1e-4, -2e-4, -3e-4], [-1e-3, -1.1e-3, -2e-5])


@pytest.mark.parametrize("poles", POLES)
def test_a_loop_with_slow_poles_of_its_own_is_proved(poles: list[float]) -> None:
    L = ct.tf([100.0, 100, 100], np.poly(poles))
    found = sc.margins(L)
    omega = brentq(lambda w: abs(L(1j * w)) - 1, 1, 1e3, xtol=1e-12)
    true = np.degrees(np.angle(-L(1j * omega)))
    assert found.confirmed
    assert found.intervals < 10_000  # it had been half a million, with nothing proved
    assert found.phase_deg.value == pytest.approx(true, rel=1e-9)
    assert found.phase_deg.at_least == pytest.approx(true, rel=1e-9)
    assert 2 * np.pi * found.gain_crossings_hz[-1] == pytest.approx(omega, rel=1e-9)
    with pytest.raises(AssertionError, match="phase"):
        assert_margins(L, phase_margin_deg=170)


def test_an_infinite_margin_of_which_less_is_proved_is_in_doubt() -> None:
    hidden = Crossing(np.inf, None, at_least=89.4)
    assert hidden.wide
    assert hidden.proved == 89.4
    gain = sc.margins(ct.tf([1], [1, 1])).gain_db
    assert gain.value == np.inf
    assert not gain.wide
