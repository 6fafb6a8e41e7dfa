"""Bounds of the ν-gap and of b(P, C): against 40 digits, Riccati equations, and each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import control
import mpmath as mp
import numpy as np
import pytest
from random_multiloops import flexible_plant, lqg_controller
from scipy.linalg import block_diag

from slewctl import Arm, Hub, InputError, Objective, arms, assemble, generalised_plant, lqg, truth
from slewctl.basis import create
from slewctl.loop.parts import negated, paired
from slewctl.loop.realisation import realisation
from slewctl.loop.robust.coprime_factors import left_graph, right_graph, winding
from slewctl.loop.robust.line_pair import Distance, Kept
from slewctl.loop.robust.ncf_margin import ncf_margin
from slewctl.loop.robust.nu_gap import graph_line, nu_gap
from slewctl.numerics.linear_system import LinearSystem

KNOWN = 1e-9


@dataclass(frozen=True, eq=False)
class PlantPair:
    """Two plants near to each other, and a controller of the first that is used with a plus."""

    first: LinearSystem
    second: LinearSystem
    controller: LinearSystem


def linear(system: control.StateSpace) -> LinearSystem:
    return LinearSystem(*(np.asarray(getattr(system, name)) for name in "ABCD"), system.dt)


def rigid_plant(rng: np.random.Generator, modes: int, signals: tuple[int, int], undamped: bool):
    """Return a double integrator with modes, some of them without damping."""
    omega, zeta = np.sort(10 ** rng.uniform(-1, 2, modes)), 10 ** rng.uniform(-4, -1.5, modes)
    zeta[rng.random(modes) < 0.5 * undamped] = 0
    blocks = [[[0, 1], [-w * w, -2 * z * w]] for w, z in zip(omega, zeta, strict=True)]
    A = block_diag([[0, 1], [0, 0]], *blocks)
    B, C = np.zeros((len(A), signals[0])), np.zeros((signals[1], len(A)))
    B[1::2], C[:, 0::2] = rng.normal(size=B[1::2].shape), rng.normal(size=C[:, 0::2].shape)
    B[1], C[:, 0] = np.abs(B[1]), np.abs(C[:, 0])
    return control.ss(A, B, C, 0)


def random_pairs(seed: int, count: int) -> Iterator[PlantPair]:
    """Yield pairs of one input or one output: damped or rigid, continuous or sampled."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        signals = [(1, 1), (1, 2), (2, 1), (1, 3)][k % 4]
        modes, size = int(rng.integers(1, 6)), 10 ** rng.uniform(-7, -0.3)
        if k % 3:
            first = rigid_plant(rng, modes, signals, undamped=k % 3 == 2)
        else:
            first = flexible_plant(rng, modes, *signals)
        A, B, C = (np.array(getattr(first, name)) for name in "ABC")
        A[np.abs(A) != 1] *= 1 + size * rng.normal()
        B, C = (matrix * (1 + size * rng.normal(size=matrix.shape)) for matrix in (B, C))
        second, controller = control.ss(A, B, C, 0), lqg_controller(rng, first)
        if k % 5 == 4:
            first, second = first.sample(0.1), second.sample(0.1)
            controller = controller.sample(0.1, method="bilinear")
        yield PlantPair(linear(first), linear(second), linear(controller))


def dual(system: LinearSystem) -> LinearSystem:
    A, B, C, D = system.matrices
    return LinearSystem(A.T, C.T, B.T, D.T, system.dt)


def exact(system: LinearSystem, s: mp.mpc) -> mp.matrix:
    """Return the frequency response in 40 digits, as a column."""
    if system.ninputs > 1:
        system = dual(system)
    A, B, C, D = (mp.matrix(matrix.tolist()) for matrix in system.matrices)
    return C * mp.lu_solve(s * mp.eye(A.rows) - A, B) + D


def point(system: LinearSystem, omega: float) -> mp.mpc:
    return mp.expj(omega * system.dt) if system.sample_time else mp.mpc(0, omega)


def exact_sines(pair: PlantPair, omega: float) -> tuple[float, float]:
    """Return the chordal distance of both plants, and what the controller keeps of it."""
    s = point(pair.first, omega)
    P, Q, K = (list(exact(x, s)) for x in (pair.first, pair.second, pair.controller))
    X, Y, W = ([mp.mpc(1), *x] for x in (P, Q, [-k for k in K]))
    sizes = [mp.sqrt(sum(abs(x) ** 2 for x in vector)) for vector in (X, Y, W)]
    n = len(X)
    wedge = [X[i] * Y[j] - X[j] * Y[i] for i in range(n) for j in range(i)]
    apart = mp.sqrt(sum(abs(x) ** 2 for x in wedge)) / (sizes[0] * sizes[1])
    kept = abs(sum(x * w for x, w in zip(X, W, strict=True))) / (sizes[0] * sizes[2])
    return apart, kept


def about(pair: PlantPair, hertz: float | None) -> np.ndarray:
    """Return frequencies about where an extreme was found, and about all poles."""
    poles = np.linalg.eigvals(pair.first.A).astype(complex)
    if pair.first.sample_time:
        poles = np.log(poles[np.abs(poles) > 0]) / pair.first.dt
    at = np.unique(np.abs(poles[poles.imag > 0]))[:2] * (1 + 1e-9)
    near = 2 * np.pi * hertz * np.array([1 - 1e-5, 1 + 1e-5, 0.9]) if hertz else np.array([1e-3])
    return np.concatenate([at, near])


@pytest.mark.slow
def test_the_bounds_hold_in_forty_digits() -> None:
    """Nowhere is the distance larger, or the margin smaller, and where it was seen it is so."""
    with mp.workdps(40):
        for pair in random_pairs(1, 10):
            gap = nu_gap(pair.first, pair.second)
            margin = ncf_margin(pair.first, pair.controller, sign=1)
            assert not gap.doubt
            assert gap.winding
            if not margin.stable:  # lost to the samples
                assert pair.first.sample_time
                continue
            (least, most), (low, high) = gap.bounds, margin.bounds
            assert most - least <= KNOWN
            assert high - low <= (np.inf if margin.doubt else KNOWN)
            for found in (gap, margin):
                for omega in about(pair, found.frequency_hz):
                    apart, kept = exact_sines(pair, float(omega))
                    assert apart <= most
                    assert kept >= low
            for found, k, (start, end) in ((gap, 0, (least, most)), (margin, 1, (low, high))):
                if found.frequency_hz and found.frequency_hz > 1e-6:
                    there = exact_sines(pair, 2 * np.pi * found.frequency_hz)[k]
                    assert start <= there <= end


def test_intervals_enclose_what_is_on_them() -> None:
    """Sine, N, P and Q at other points of random intervals, near and far from poles."""
    rng = np.random.default_rng(8)
    for pair in random_pairs(5, 12):
        p = pair.first.noutputs
        scale = np.ones(max(p, pair.first.ninputs))
        P, Q, K = (
            graph_line(system, scale, "system")
            for system in (pair.first, pair.second, negated(pair.controller))
        )
        sizes = np.abs(np.concatenate([P.sigma, [1.0]]))
        c = 10 ** rng.uniform(np.log10(sizes.min()) - 1, np.log10(sizes.max()) + 1, 60)
        c = np.concatenate([c, np.abs(P.sigma) * (1 + 1e-3 * rng.normal(size=len(P.sigma)))])
        h = c * 10 ** rng.uniform(-4, -0.3, len(c))
        for lines in (Distance(P, Q), Kept(P, K)):
            low = bool(P.order) & (rng.random(len(c)) < 0.5)
            with np.errstate(all="ignore"):  # an interval may have two poles that nothing damps
                enclosing(lines, c, h, low)


def enclosing(lines: Distance | Kept, c: np.ndarray, h: np.ndarray, low: np.ndarray) -> None:
    """Hold what is said of intervals against points of them."""
    found = lines.enclosed(c, h, low)
    assert np.isfinite(found.bounds).mean() > 0.5
    for part in (-1.0, -0.6, 0.3, 1.0):
        sine = lines.on_axis(c + part * h)[1]
        assert not np.any(found.bounds[0] > sine + 1e-12)
        assert not np.any(found.bounds[1] < sine - 1e-12)
        there = lines.enclosed(c + part * h, 0 * h, low)
        alike = (found.taken[0] == there.taken[0]) & (found.taken[1] == there.taken[1])
        assert alike.mean() > 0.2
        for name in ("N", "P", "Q", "PQ"):
            own, other, step = getattr(found, name), getattr(there, name), part * h
            off = np.abs(other.value - own.value - own.slope * step)
            room = own.curve * step**2 / 2 + 1e-11 * (np.abs(own.value) + other.value)
            # A sine is known to 1e-14.
            room += 1e-14 * np.sqrt(np.abs(own.value) * there.PQ.value) * (name == "N")
            assert not np.any((off > room)[alike])


def test_riccati_equations_and_level_sets_say_the_same() -> None:
    for pair in random_pairs(2, 12):
        one, two = (realisation(system, "plant").balanced for system in (pair.first, pair.second))
        right = right_graph(one)
        distance = left_graph(two).after(right).peak().value
        gap = nu_gap(pair.first, pair.second)
        assert gap.largest_distance == pytest.approx(distance, rel=1e-3, abs=1e-9)
        assert gap.winding == winding(right_graph(two), right)
        both = paired(pair.first, pair.controller, 1)
        closed = realisation(both.plant, "plant").closed(realisation(both.positive, "controller"))
        margin = ncf_margin(pair.first, pair.controller, sign=1)
        assert margin.stable == closed.stable
        assert margin.value == pytest.approx(1 / closed.peak().value, rel=2e-8)


def test_the_dual_plants_are_as_far_apart() -> None:
    for pair in random_pairs(3, 4):
        there = nu_gap(pair.first, pair.second)
        back = nu_gap(dual(pair.second), dual(pair.first))
        assert back.bounds[0] <= there.bounds[1]
        assert there.bounds[0] <= back.bounds[1]


@pytest.mark.slow
@pytest.mark.parametrize("pole", [0.3, -0.3, 2.0])
def test_turns_are_counted_where_poles_are_unstable_or_on_the_axis(pole: float) -> None:
    """Against zeros of G₂~G₁, for a lag k/(s − p) beside an oscillator, an integrator, and both."""
    others = [
        control.tf([1.0], [1, 0]), control.tf([0.7, 0.1], [1, 0, 1]), control.tf([1], [1, 0, 0]),
        control.tf([1.0, 0.5], [1, 0.2, 1, 0]), control.tf([2.0], [1, -1]),
    ]  # fmt: skip
    lags = [control.tf([k], [1, -pole]) for k in (0.1, 3.0)]
    systems = [linear(control.tf2ss(system)) for system in [*others, *lags]]
    for first in systems:
        for second in systems:
            if first is second:
                continue
            one, two = (realisation(system, "plant").balanced for system in (first, second))
            right = right_graph(one)
            distance = left_graph(two).after(right).peak().value
            gap = nu_gap(first, second)
            assert gap.largest_distance == pytest.approx(min(distance, 1), abs=2e-8)
            if distance < 1 - 1e-6:
                assert gap.winding == winding(right_graph(two), right)


def test_plants_that_almost_agree_need_no_more_intervals() -> None:
    """A truth of twelve modes and its model on five functions: apart by 1e-4 of one."""
    arm = Arm(arms.paper_beam().beam, Hub(0.2), damping_ratio=0.002)
    noise = {"torque": 0.1, "theta": 0.01, "theta_dot": 0.1}
    objective = Objective({"tip": 0.03, "torque": 1.0}, noise)
    model = generalised_plant(assemble(arm, create("arm-matched", 5)), objective)
    true = generalised_plant(truth(arm, 12), objective)
    gap, margin = nu_gap(model, true), ncf_margin(true, lqg(model))
    for found in (gap, margin):
        assert not found.doubt
        assert found.bounds[1] - found.bounds[0] <= KNOWN
        assert found.intervals < 2000
    assert 0 < gap.value < 2e-3


def test_equal_plants_are_not_apart() -> None:
    for pair in random_pairs(4, 3):
        gap = nu_gap(pair.first, pair.first)
        assert gap.bounds[0] == 0
        assert gap.value < 1e-12
        assert gap.bounds[1] < KNOWN


def test_modes_on_the_axis_that_are_hidden_are_refused_and_several_at_one_place_not_proved() -> (
    None
):
    oscillator = np.array([[0.0, 1.0], [-1.0, 0.0]])
    one = np.array([[0.0], [1.0], [0.0], [0.0]])
    plant = LinearSystem([[-1.0]], [[1.0]], [[1.0]], [[0.0]])
    hidden = LinearSystem(block_diag([[0, 1], [-4, 0]], oscillator), one,
                          [[1.0, 0, 1, 0]], [[0.0]])  # fmt: skip
    A = block_diag(oscillator, oscillator)
    A[1, 2] = 1.0
    twice = LinearSystem(A, one[[2, 3, 0, 1]], [[1.0, 0, 0, 0]], [[0.0]])
    with pytest.raises(InputError, match="coprime"):
        nu_gap(plant, hidden)
    found = nu_gap(plant, twice)
    assert found.bounds is None
    assert "several are at one place" in found.doubt
    unmoved = ncf_margin(hidden, LinearSystem([[-1.0]], [[1.0]], [[1.0]], [[0.0]]))
    assert (unmoved.value, unmoved.stable) == (0.0, False)
