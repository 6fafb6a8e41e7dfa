"""Certificates of margins, checked in exact and interval arithmetic by another program."""

from __future__ import annotations

import certificate_checker as checker
import control
import numpy as np
import pytest
from flexible_loops import random_flexible_loops
from loop_examples import stable_loop
from mixed_loops import random_mixed_loops

from slewctl.loop.margin_functions import margins
from slewctl.loop.parts import paired
from slewctl.loop.single.certificate import Certificate, certify, margins_of
from slewctl.loop.single.factored_loop import factored
from slewctl.loop.single.mode_names import modes_of_pair
from slewctl.loop.single.search import COMPLEMENTARY, DISK, MODULUS, REAL, UNIT, WINDING
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem


def check(found: Certificate, G: LinearSystem, K: LinearSystem) -> None:
    """Fail where a certificate claims what is not so, or leaves a part of the axis out."""
    checker.precision()
    N, P = checker.exact_fraction(G, K, G.sample_time)
    of, search = checker.Polynomials.of(N, P), found.search
    start = found.start.end if found.start else 0.0
    for question in (UNIT, REAL, WINDING, MODULUS, DISK, COMPLEMENTARY):
        assert checker.covered(*search.proof(question), start, found.end.start)
    if not len(search.unit_touched.arrays[0]):
        crossings = checker.unit_crossings(of, *search.proof(UNIT))
        assert crossings == len(search.unit.arrays[0])
    assert found.unstable == checker.unstable_roots(N, P)
    for kind, shift in search.shifts.items():
        proved = search.least(kind).proved * (1 - 1e-9)
        assert checker.farther(of, proved, shift, *search.proof(kind))
    if found.start:
        least = checker.exact(found.start.least)
        large = checker.positive(of.gain - least**2 * of.poles)
        assert checker.holds([large], 0.0, start)
    limit, away = (checker.exact(value) for value in (found.end.limit, found.end.away))
    # |N − limit P| ≤ away |P|
    rest = of.gain - 2 * limit * of.real + (limit**2 - away**2) * of.poles
    assert checker.beyond(-rest, found.end.start)


def loops(kind: str) -> list[tuple[LinearSystem, LinearSystem]]:
    if kind == "flexible":
        chosen = [loop for loop in random_flexible_loops(5, 100) if len(loop.omega) <= 8]
        pairs = [paired(loop.plant, loop.controller) for loop in chosen[:4]]
    else:
        pairs = [paired(x.plant, x.controller, x.sign) for x in random_mixed_loops(7, 9)]
    return [(pair.plant, pair.negative) for pair in pairs]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["flexible", "mixed"])
def test_what_the_intervals_claim_is_so(kind: str) -> None:
    checked = stable = 0
    for G, K in loops(kind):
        with np.errstate(all="ignore"):
            found = certify(factored(G, K))
        if found.unstable is None:
            continue
        checked += 1
        if found.unstable:
            N, P = checker.exact_fraction(G, K, G.sample_time)
            assert found.unstable == checker.unstable_roots(N, P)
            continue
        check(found, G, K)
        stable += 1
    assert checked >= (4 if kind == "flexible" else 8)
    assert stable >= 2


def test_gain_margins_hold_on_every_interval() -> None:
    for G, K in loops("mixed")[:6]:
        pair = paired(G, K)
        with np.errstate(all="ignore"):
            found = certify(factored(G, K))
            if found.unstable != 0:
                continue
            told = margins_of(found, series(G, K), 0.0, modes_of_pair(pair))
        rise = 10 ** ((told.gain_db.at_least or 0.0) / 20) * (1 - 1e-9)
        fall = 10 ** (-(told.gain_reduction_db.at_least or 0.0) / 20) * (1 + 1e-9)
        of = checker.Polynomials.of(*checker.exact_fraction(G, K, G.sample_time))
        assert checker.no_limit_between(of, rise, fall, *found.search.proof(REAL))


def test_a_false_claim_is_found_out() -> None:
    """The checker can fail: of a distance that is a millionth too large."""
    G, K = loops("mixed")[0]
    with np.errstate(all="ignore"):
        found = certify(factored(G, K))
    of = checker.Polynomials.of(*checker.exact_fraction(G, K, G.sample_time))
    too_far = found.search.least(MODULUS).value * (1 + 1e-6)
    assert not checker.farther(of, too_far, 0.0, *found.search.proof(MODULUS))


@pytest.mark.parametrize("lag", [1e-3, 1e-6])
def test_a_rigid_body_behind_a_lag_is_certified(lag: float) -> None:
    """Coupled with the lag, the two poles at the origin are known to rounding alone."""
    loop = stable_loop()
    before = control.ss([[-1 / lag]], [[1 / lag]], [[1.0]], [[0.0]])
    told = margins(control.series(before, loop.plant.control_path), loop.controller)
    assert told.intervals > 0
    assert told.gain_db.value == pytest.approx(loop.margins.gain_db.value, abs=300 * lag)
    assert told.gain_db.at_least == pytest.approx(told.gain_db.value, rel=1e-7)
