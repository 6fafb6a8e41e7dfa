"""Random flexible loops in modal form, continuous and sampled, with L in closed form.

A rigid body and 5 to 60 modes, ζ from 1e-4 to 0.02, under LQG designed on the first few of
them or under PD with notches.  Many are unstable: the controller has not seen most modes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import control
import numpy as np
from brute_force import BruteMargins, brute_margins, resolved_grid
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from slewctl.errors import AccuracyError
from slewctl.numerics.given_system import static
from slewctl.numerics.matrix_equations import solve_riccati

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class FlexibleLoop:
    """Σ residue/(s² + 2ζωs + ω²), with a rigid body at ω = 0, times a controller.

    Attributes
    ----------
    omega, zeta, residues : ndarray
        The rigid body, of frequency zero, comes first.
    controller : control.StateSpace
        Under negative feedback; with dt > 0 the plant is sampled with a zero-order hold.
    """

    omega: Array
    zeta: Array
    residues: Array
    controller: control.StateSpace

    @property
    def step(self) -> float:
        return float(self.controller.dt or 0.0)

    @property
    def plant(self) -> control.StateSpace:
        """The plant as blocks of two states, exactly sampled where the controller is."""
        blocks, drives, reads = [], [], []
        for w, z, r in zip(self.omega, self.zeta, self.residues, strict=True):
            size = w or 1.0  # states ωq and its rate over ω: blocks of balanced entries
            A = np.array([[0.0, size], [-(w**2) / size, -2 * z * w]])
            B = np.array([[0.0], [np.sqrt(abs(r))]])
            if self.step:
                whole = expm(np.block([[A, B], [np.zeros((1, 3))]]) * self.step)
                A, B = whole[:2, :2], whole[:2, 2:]
            blocks.append(A)
            drives.append(B)
            reads.append([np.sign(r) * np.sqrt(abs(r)) / size, 0.0])
        return control.StateSpace(
            block_diag(*blocks), np.vstack(drives), np.concatenate(reads)[None], 0, self.step
        )

    @property
    def loop(self) -> control.StateSpace:
        """L = plant · controller."""
        return self.plant * self.controller

    @property
    def function(self) -> Callable[[Array], ComplexArray]:
        """L at each ω in rad/s, from closed forms of the plant and direct solves of K."""
        K, T = self.controller, self.step
        w, z, r = (v[1:, None] for v in (self.omega, self.zeta, self.residues))
        rigid = self.residues[0]
        p = w * (-z + 1j * np.sqrt(1 - z**2))

        def modes(s: ComplexArray) -> ComplexArray:
            if not T:
                return rigid / s**2 + np.sum(r / ((s - p) * (s - p.conj())), axis=0)
            # A pole p with residue c becomes c(e^(pT) − 1)/p/(z − e^(pT)).
            total = rigid * T**2 / 2 * (np.exp(s * T) + 1) / np.expm1(s * T) ** 2
            for pole in (p, p.conj()):
                c = r / (pole - pole.conj())
                total = total + np.sum(
                    c * np.expm1(pole * T) / pole / (np.exp(pole * T) * np.expm1((s - pole) * T)),
                    axis=0,
                )
            return total

        def value(omega: Array) -> ComplexArray:
            s = 1j * np.asarray(omega, dtype=float)
            parts = np.array_split(s, max(1, len(s) // 4000))
            return np.concatenate([modes(part) * _response(K, part) for part in parts])

        return value

    @property
    def closed_poles(self) -> ComplexArray:
        """Closed-loop poles, in s or z."""
        L = self.loop
        return np.linalg.eigvals(L.A - L.B @ L.C / (1 + L.D))

    @property
    def stable(self) -> bool:
        """Whether the closed loop is stable, by counting turns of 1 + L over a resolved grid."""
        grid = self.grid(25)
        s = 1j * grid
        # Poles at the origin, two of the rigid body and integrators, are divided out against
        # as many stable ones.
        poles = np.linalg.eigvals(self.controller.A)
        distance = np.abs(poles - (1 if self.step else 0))
        integrators = distance < 1e-9 * (1 if self.step else self.omega[1])
        knee = self.omega[1]
        if self.step:
            z = np.exp(s * self.step)
            ratio = np.expm1(s * self.step) / (z - np.exp(-knee * self.step))
        else:
            ratio = s / (s + knee)
        value = (1 + self.function(grid)) * ratio ** (2 + int(np.sum(integrators)))
        turns = np.sum(np.angle(value[1:] / value[:-1])) / np.pi
        outside = np.abs(poles) > 1 if self.step else poles.real > 0
        return bool(round(float(np.sum(outside & ~integrators) - turns)) == 0)

    @property
    def all_poles(self) -> ComplexArray:
        """Open- and closed-loop poles in s."""
        poles = np.concatenate([np.linalg.eigvals(self.loop.A), self.closed_poles])
        if self.step:
            poles = np.log(poles[np.abs(poles) > 1e-9]) / self.step
        return poles

    def grid(self, points: int) -> Array:
        grid = resolved_grid(self.all_poles, points)
        return grid[grid < np.pi / self.step] if self.step else grid

    def truth(self, points: int = 25) -> BruteMargins:
        """Return the margins by brute force."""
        limit = np.pi / self.step if self.step else np.inf
        return brute_margins(self.function, self.all_poles, points, limit)


def _response(K: control.StateSpace, s: ComplexArray) -> ComplexArray:
    """Return K at each s by direct solves, in δ = z − 1 where it is sampled."""
    step = float(K.dt or 0.0)
    A = K.A - np.eye(K.nstates) if step else K.A
    point = np.expm1(s * step) if step else s
    matrix = point[:, None, None] * np.eye(K.nstates) - A
    solved = np.linalg.solve(matrix, np.broadcast_to(K.B, (len(s), *K.B.shape)).astype(complex))
    return (K.C @ solved)[:, 0, 0] + K.D[0, 0]


def random_flexible_loop(
    rng: np.random.Generator, modes: int | None = None, most: int = 60
) -> FlexibleLoop:
    """Return a random loop, stable or not, of `modes` modes or 5 to `most`."""
    n = modes or int(rng.integers(5, most + 1))
    spread = rng.uniform(1.0, 2.0)  # ω_i ∝ i^spread: from a string to a beam
    omega = float(10 ** rng.uniform(-1, 2)) * (np.arange(1, n + 1) - rng.uniform(0, 0.4)) ** spread
    omega = omega * np.sort(1 + rng.uniform(-0.02, 0.02, n))
    zeta = np.full(n, 10 ** rng.uniform(-4, np.log10(0.02))) * rng.uniform(0.7, 1.4, n)
    signs = np.ones(n) if rng.random() < 0.5 else rng.choice([-1.0, 1.0], n)
    residues = signs * rng.uniform(0.05, 2.0, n)
    omega = np.concatenate([[0.0], omega])
    zeta, residues = np.concatenate([[0.0], zeta]), np.concatenate([[1.0], residues])
    design = _lqg if rng.random() < 0.5 else _pd_with_notches
    K = design(rng, omega, zeta, residues)
    if rng.random() < 0.5:
        bandwidth = omega[1] * float(10 ** rng.uniform(0, 1))
        K = K.sample(2 * np.pi / (bandwidth * float(rng.uniform(4, 40))), method="bilinear")
        if rng.random() < 0.5:
            K = control.StateSpace(0, 1, 1, 0, K.dt) * K  # computed during the next sample
    return FlexibleLoop(omega, zeta, residues, K)


def _lqg(
    rng: np.random.Generator, omega: Array, zeta: Array, residues: Array
) -> control.StateSpace:
    m = int(rng.integers(1, 5))
    empty = static(1.0)
    P = FlexibleLoop(omega[: m + 1], zeta[: m + 1], residues[: m + 1], empty).plant
    speed = omega[1] * float(10 ** rng.uniform(-1.3, 0.5))
    Q, R = P.C.T @ P.C, np.array([[speed**-4]])
    W, V = P.B @ P.B.T, np.array([[(speed * float(rng.uniform(1, 6))) ** -4]])
    gain = solve_riccati(P.A, P.B, Q, R).gain
    filter_ = solve_riccati(P.A.T, P.C.T, W, V).gain.T
    return control.StateSpace(P.A - P.B @ gain - filter_ @ P.C, filter_, gain, 0)


def _pd_with_notches(
    rng: np.random.Generator, omega: Array, zeta: Array, residues: Array
) -> control.StateSpace:
    del zeta
    speed = omega[1] * float(10 ** rng.uniform(-1.5, 0.3))
    lag = speed * float(10 ** rng.uniform(0.7, 1.5))
    kp, kd = speed**2, 1.4 * speed
    K = control.StateSpace(-lag, 1.0, -kd * lag**2, kp + kd * lag)
    K = control.StateSpace(-lag, 1.0, lag, 0) * K if rng.random() < 0.5 else K
    if rng.random() < 0.4:  # integral action: the gain may not fall without limit
        K = control.StateSpace(0, 1, 0.1 * speed, 1) * K
    for w in omega[1 : 1 + int(rng.integers(0, 4))]:
        w0, deep, wide = w * rng.uniform(0.95, 1.05), rng.uniform(0.001, 0.1), rng.uniform(0.2, 0.9)
        K = K * control.StateSpace(
            [[0, w0], [-w0, -2 * wide * w0]], [[0], [1]], [[0, 2 * (deep - wide) * w0]], 1
        )
    return K


def random_flexible_loops(seed: int, count: int, most: int = 60) -> list[FlexibleLoop]:
    """Return `count` random loops of 5 to `most` modes, stable and unstable."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        try:
            found.append(random_flexible_loop(rng, most=most))
        except AccuracyError:
            continue
    return found
