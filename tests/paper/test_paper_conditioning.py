"""The third finding: raw coordinates stop a solver, scaled ones do not."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import mpmath as mp
import numpy as np
import pytest
from precise_shapes import shape

from slewctl.paper import PaperReproduction
from slewctl.paper.conditioning import HUB_RATIOS, MOST_FUNCTIONS, Attempt, ConditioningFinding
from slewctl.paper.conditioning_prose import conditioning_words
from slewctl.paper.findings import DAMPING_RATIO

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("paper")]


@pytest.fixture
def finding(reproduction: PaperReproduction) -> ConditioningFinding:
    return reproduction.conditioning


def attempts(finding: ConditioningFinding, kind: str) -> list[Attempt]:
    return [
        a
        for p in finding.points
        for a in (getattr(p, f"covariance_{kind}"), getattr(p, f"riccati_{kind}"))
    ]


def test_every_case_is_there(finding: ConditioningFinding) -> None:
    assert len(finding.points) == len(HUB_RATIOS) * 2 * MOST_FUNCTIONS
    for ratio in HUB_RATIOS:
        for basis in ("clamped-free", "slewing"):
            assert [p.n for p in finding.of(ratio, basis)] == list(range(1, MOST_FUNCTIONS + 1))


def test_raw_coordinates_stop_the_solver_and_scaling_cures_it(finding: ConditioningFinding) -> None:
    raw, scaled = attempts(finding, "raw"), attempts(finding, "scaled")
    assert sum(not a.optimal for a in raw) >= 10
    assert all(a.gap is not None and a.gap < 1e-5 for a in scaled)
    assert finding.own_gap is not None
    assert finding.own_gap <= 1e-11


def test_the_papers_argument_holds_without_a_hub(finding: ConditioningFinding) -> None:
    """Without a hub the new functions' matrices are less stiff, and a solver gets farther."""
    for reach in finding.reaches:
        if reach.hub_ratio == 0 and reach.basis == "slewing":
            other = next(
                r for r in finding.reaches
                if (r.hub_ratio, r.form, r.basis) == (0, reach.form, "clamped-free")
            )  # fmt: skip
            assert reach.raw > other.raw
    clamped, slewing = (finding.of(0.0, basis)[-1] for basis in ("clamped-free", "slewing"))
    assert clamped.raw_condition > 30 * slewing.raw_condition
    clamped, slewing = (finding.of(1.0, basis)[-1] for basis in ("clamped-free", "slewing"))
    assert slewing.mass_condition > 100 * clamped.mass_condition
    assert slewing.raw_condition > 0.5 * clamped.raw_condition


def test_scaling_lowers_the_condition_number(finding: ConditioningFinding) -> None:
    """From four powers of the frequency ratio to one, whatever the basis."""
    for p in finding.points:
        assert p.scaled_condition <= p.raw_condition
    for ratio in HUB_RATIOS:
        for basis in ("clamped-free", "slewing"):
            last = finding.of(ratio, basis)[-1]
            assert last.raw_condition > 1e3 * last.scaled_condition


def test_gaps_are_shown_to_a_decade_where_they_are_noise(finding: ConditioningFinding) -> None:
    found = [a.gap for p in finding.points for a in (p.own, p.riccati_scaled, p.covariance_raw)]
    small = [gap for gap in found if gap is not None and gap < 1e-6]
    assert small
    for gap in small:
        assert gap >= 1e-12
        assert math.log10(gap) == pytest.approx(round(math.log10(gap)), abs=1e-9)
    assert {a.gap is None for a in attempts(finding, "raw") if a.optimal} == {False}


def test_words_follow_the_figures(finding: ConditioningFinding) -> None:
    words = conditioning_words(finding)
    assert len(words) == len(HUB_RATIOS) + 2
    assert "scaling cures it" in words[-1]
    assert f"{finding.without_point} ended without" in words[-2]
    everything = tuple(replace(r, raw=MOST_FUNCTIONS) for r in finding.reaches)
    assert "do not hurt the solver" in conditioning_words(replace(finding, reaches=everything))[0]
    turned = tuple(replace(r, raw=5 if r.basis == "clamped-free" else 2) for r in finding.reaches)
    assert "does not hold" in conditioning_words(replace(finding, reaches=turned))[0]
    broken = replace(
        finding.points[0], riccati_scaled=Attempt("failed", None, optimal=False, believed=False)
    )
    uncured = replace(finding, points=(broken, *finding.points[1:]))
    assert "does not cure every case" in conditioning_words(uncured)[-1]


def test_condition_numbers_are_those_of_the_matrices(finding: ConditioningFinding) -> None:
    """Mass, stiffness and state matrix once more, in forty digits and from the printed shapes."""
    eps = float(np.finfo(float).eps)
    for p in finding.points:
        if p.n not in (1, 2, 5, MOST_FUNCTIONS):
            continue
        right = precise_conditions(p.hub_ratio, p.basis, p.n)
        told = (p.mass_condition, p.stiffness_condition, p.raw_condition, p.scaled_condition)
        for found, value in zip(told, right, strict=True):
            # The smallest singular value of a matrix is known to eps times the largest.
            assert found == pytest.approx(value, rel=1e-11 + 50 * eps * value)


def precise_conditions(ratio: float, basis: str, n: int) -> tuple[float, float, float, float]:
    """Condition numbers of M and K_e, of the raw state matrix and of the scaled one."""
    with mp.workdps(40):
        mass, stiffness = precise_matrices(basis)
        M = mass[: n + 1, : n + 1].copy()
        M[0, 0] += mp.mpf(ratio) * mass[0, 0]
        K = mp.zeros(n + 1)
        K[1:, 1:] = stiffness[:n, :n]
        root = mp.inverse(mp.cholesky(M))
        squared, turned = mp.eigsy(root * K * root.T)
        U = root.T * turned  # UᵀMU = I; the rigid rotation is the first
        omega = [mp.mpf(0), *(mp.sqrt(value) for value in list(squared)[1:])]
        zeta = mp.mpf(DAMPING_RATIO)
        A = mp.zeros(2 * n + 2)
        A[: n + 1, n + 1 :] = mp.eye(n + 1)
        A[n + 1 :, : n + 1] = -U * mp.diag([w**2 for w in omega]) * U.T * M
        A[n + 1 :, n + 1 :] = -U * mp.diag([2 * zeta * w for w in omega]) * U.T * M
        raw = mp.svd_r(A, compute_uv=False)
        # A mode's [[0, ω], [−ω, −2ζω]] has the singular values ω(√(1 + ζ²) ± ζ).
        scaled = omega[-1] / omega[1] * (mp.sqrt(1 + zeta**2) + zeta) ** 2
        spread = (spread_of(M), spread_of(K[1:, 1:]), raw[0] / raw[2 * n], scaled)
        return tuple(float(value) for value in spread)


def spread_of(symmetric: mp.matrix) -> mp.mpf:
    """Return the largest over the smallest eigenvalue."""
    values = list(mp.eigsy(symmetric, eigvals_only=True))
    return max(values) / min(values)


@cache
def precise_matrices(basis: str) -> tuple[mp.matrix, mp.matrix]:
    """M without a hub and K_e of `MOST_FUNCTIONS` functions, m̄ = EI = 1 − (5/6)x³, L = 1."""
    size = MOST_FUNCTIONS + 1
    M, K = mp.zeros(size), mp.zeros(size - 1)
    with mp.workdps(40):
        # A rule with positive weights changes no quadratic form by more than its weights' rounding.
        for point, weight in zip(*np.polynomial.legendre.leggauss(60), strict=True):
            x = mp.mpf((1 + point) / 2)
            share = weight / 2 * (1 - mp.mpf(5) / 6 * x**3)
            rows = [x, *(shape(basis, i, x, 0) for i in range(1, size))]
            bent = [shape(basis, i, x, 2) for i in range(1, size)]
            for i in range(size):
                for j in range(size):
                    M[i, j] += share * rows[i] * rows[j]
                    if i and j:
                        K[i - 1, j - 1] += share * bent[i - 1] * bent[j - 1]
    return M, K
