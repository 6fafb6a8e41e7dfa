"""The norms of systems: known values, python-control's, and what has none."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import slewctl as sc
from slewctl.numerics.frequency_response import FrequencyResponse
from slewctl.numerics.given_system import read_system


def random_stable(seed: int, dt: float | None) -> control.StateSpace:
    rng = np.random.default_rng(seed)
    n, m, p = (int(k) for k in rng.integers(1, 5, 3))
    A = rng.normal(size=(n, n))
    if dt:
        A *= 0.95 / max(np.abs(np.linalg.eigvals(A)).max(), 1e-3)
    else:
        A -= (np.linalg.eigvals(A).real.max() + 0.1) * np.eye(n)
    D = rng.normal(size=(p, m)) if dt else np.zeros((p, m))
    return control.ss(A, rng.normal(size=(n, m)), rng.normal(size=(p, n)), D, dt or 0)


@given(st.integers(0, 10_000), st.sampled_from([None, 0.1]))
def test_norms_agree_with_a_gramian_and_a_dense_grid(seed: int, dt: float | None) -> None:
    system = random_stable(seed, dt)
    gramian = control.lyap(system.A, system.B @ system.B.T) if not dt else control.dlyap(
        system.A, system.B @ system.B.T
    )  # fmt: skip
    squared = np.trace(system.C @ gramian @ system.C.T) + np.sum(np.asarray(system.D) ** 2)
    assert sc.norm(system) == pytest.approx(np.sqrt(squared), rel=1e-8)
    top = np.pi / dt if dt else 1e3
    omega = np.concatenate([[0.0], np.geomspace(1e-4, top, 3000)])
    values = FrequencyResponse(read_system(system, "G"))(omega).reshape(
        len(omega), *np.asarray(system.D).shape
    )
    seen = np.linalg.norm(values, 2, axis=(1, 2)).max()
    peak = sc.norm(system, "inf")
    assert seen <= peak * (1 + 1e-9)
    assert peak <= seen * 1.02


def test_known_values() -> None:
    lag = control.tf([1], [0.5, 1])
    assert sc.norm(lag) == pytest.approx(1.0, rel=1e-12)  # 1/√(2T)
    zeta = 1e-4
    resonance = control.tf([1], [1, 2 * zeta, 1])
    exact = 1 / (2 * zeta * np.sqrt(1 - zeta**2))
    assert sc.norm(resonance, "inf") == pytest.approx(exact, rel=1e-9)
    assert sc.norm(resonance) == pytest.approx(np.sqrt(1 / (4 * zeta)), rel=1e-9)
    assert sc.norm(resonance, np.inf) == sc.norm(resonance, "inf")
    assert sc.norm(control.tf([3.0], [1]), "inf") == pytest.approx(3.0)


@pytest.mark.parametrize("p", [2, "inf"])
def test_an_unstable_or_undamped_system_has_none(p: float | str) -> None:
    for denominator in ([1, -1e-3], [1, 0], [1, 0, 1]):
        assert sc.norm(control.tf([1], denominator), p) == np.inf
    assert sc.norm(control.tf([1], [1, -1.0], 0.1), p) == np.inf


def test_white_noise_that_passes_straight_has_no_finite_power() -> None:
    assert sc.norm(control.tf([1, 1], [1, 2])) == np.inf
    assert sc.norm(control.tf([1, 1], [1, 2]), "inf") == pytest.approx(1.0)


@pytest.mark.parametrize("loud", [1.0, 1e6, 1e20])
def test_the_norm_of_a_sampled_system_does_not_depend_on_what_nobody_sees(loud: float) -> None:
    slow = 1 - 1e-6
    G = control.ss(np.diag([0.5, slow]), [[loud], [1.0]], [[0.0, 1.0]], 0, 0.1)
    assert sc.norm(G) == pytest.approx((1 - slow**2) ** -0.5, rel=1e-9)


def test_what_is_no_system_is_refused() -> None:
    with pytest.raises(sc.InputError, match="state-space"):
        sc.norm(3.0)  # type: ignore[arg-type]
    with pytest.raises(sc.InputError, match="p: "):
        sc.norm(control.tf([1], [1, 1]), 1)
    with pytest.raises(sc.InputError, match="sample time"):
        sc.norm(control.tf([1], [1, 0.5], True))


def test_a_transfer_function_is_reduced_like_its_state_space() -> None:
    G = control.tf([8, 6, 2], [1, 4, 5, 2])
    hankel = sc.balanced_truncation(G, 2).hankel
    np.testing.assert_allclose(hankel, [1.144118688, 0.725878969, 0.0817602814], rtol=1e-8)
