"""`h2syn` of any partitioned system: it cannot be bettered, and what it is worth is recomputed."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slewctl as sc

seeds = st.integers(0, 10_000)
clocks = st.sampled_from([0.0, 0.1])


def partitioned(
    seed: int, dt: float, *, straight: bool = False
) -> tuple[control.StateSpace, int, int]:
    """A random system with cross terms and D₂₂; with D₁₁ where that can be cancelled."""
    rng = np.random.default_rng(seed)
    n, m, p = (int(k) for k in rng.integers(1, 4, 3))
    A = rng.normal(size=(n, n)) * (0.6 if dt else 1.0)
    w, z = p + 2, m + 2
    D12, D21 = rng.normal(size=(z, m)), rng.normal(size=(p, w))
    D11 = D12 @ rng.normal(size=(m, p)) @ D21 if straight else np.zeros((z, w))
    D22 = 0.2 * rng.normal(size=(p, m))
    system = control.ss(
        A, rng.normal(size=(n, w + m)), rng.normal(size=(z + p, n)),
        np.block([[D11, D12], [D21, D22]]), dt,
    )  # fmt: skip
    return system, p, m


def closed(P: control.StateSpace, K: control.StateSpace, p: int, m: int) -> control.StateSpace:
    loop = P.lft(K, m, p)  # python-control's own
    if loop.dt:
        return loop
    assert np.abs(loop.D).max() < 1e-11  # what is left of a D₁₁ that K cancels
    return control.ss(loop.A, loop.B, loop.C, np.zeros_like(loop.D))


@given(seeds, clocks, st.booleans())
@settings(max_examples=40)
def test_no_controller_near_it_is_better(seed: int, dt: float, straight: bool) -> None:
    P, p, m = partitioned(seed, dt, straight=straight)
    K = sc.h2syn(P, p, m)
    best = sc.norm(closed(P, K, p, m))
    assert np.isfinite(best)
    rng = np.random.default_rng(seed)
    for _ in range(6):
        moved = [
            np.asarray(matrix) + 1e-3 * rng.normal(size=np.shape(matrix))
            for matrix in (K.A, K.B, K.C)
        ]
        # The feedthrough of a continuous loop is fixed: any other costs infinitely much.
        D = np.asarray(K.D) + (1e-3 * rng.normal(size=np.shape(K.D)) if dt else 0)
        other = control.ss(*moved, D, dt)
        assert sc.norm(closed(P, other, p, m)) >= best * (1 - 1e-9)


@given(seeds, clocks)
@settings(max_examples=20)
def test_d22_moves_the_controller_and_not_the_cost(seed: int, dt: float) -> None:
    P, p, m = partitioned(seed, dt)
    without = np.array(P.D)
    without[-p:, -m:] = 0
    other = control.ss(P.A, P.B, P.C, without, dt)
    one = sc.norm(closed(P, sc.h2syn(P, p, m), p, m))
    two = sc.norm(closed(other, sc.h2syn(other, p, m), p, m))
    assert one == pytest.approx(two, rel=1e-7)


def test_of_an_arm_it_is_lqg() -> None:
    arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    plant = problem.plant("clamped-free", 2)
    K, designed = sc.h2syn(plant.system, 1, 1), sc.lqg(plant)
    assert isinstance(K, control.StateSpace)
    assert K.input_labels == ["theta"]
    assert K.output_labels == ["torque"]
    assert sc.norm(plant.close(K)) ** 2 == pytest.approx(designed.h2_cost, rel=1e-9)


def test_what_has_no_optimum_is_refused() -> None:
    P, p, m = partitioned(3, 0.0)
    with pytest.raises(sc.InputError, match="nmeas"):
        sc.h2syn(P, P.noutputs, m)
    with pytest.raises(sc.InputError, match="ncon"):
        sc.h2syn(P, p, 0)
    with pytest.raises(sc.InputError, match="state-space"):
        sc.h2syn(3, 1, 1)  # type: ignore[arg-type]
    passing = np.array(P.D)
    passing[:-p, :-m] = 1.0
    with pytest.raises(sc.DesignError, match="white noise"):
        sc.h2syn(control.ss(P.A, P.B, P.C, passing), p, m)
    free = np.array(P.D)
    free[:-p, -m:] = 0
    with pytest.raises(sc.DesignError, match="no penalty"):
        sc.h2syn(control.ss(P.A, P.B, P.C, free), p, m)
    silent = np.array(P.D)
    silent[-p:, :-m] = 0
    with pytest.raises(sc.DesignError, match="no noise"):
        sc.h2syn(control.ss(P.A, P.B, P.C, silent), p, m)
