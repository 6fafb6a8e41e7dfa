"""Random loops with several channels: flexible plants under LQG, and their μ in closed form."""

from __future__ import annotations

from collections.abc import Iterator

import control
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are
from scipy.optimize import minimize_scalar

Array = NDArray[np.float64]


def flexible_plant(
    rng: np.random.Generator, modes: int, inputs: int, outputs: int
) -> control.StateSpace:
    """Return a plant of lightly damped modes over three decades, in balanced modal states."""
    omega = np.sort(10 ** rng.uniform(-1, 2, modes))
    zeta = 10 ** rng.uniform(-4, np.log10(0.02), modes)
    A = np.zeros((2 * modes, 2 * modes))
    A[:modes, modes:] = np.diag(omega)
    A[modes:, :modes] = -np.diag(omega)
    A[modes:, modes:] = -np.diag(2 * zeta * omega)
    drive = rng.normal(size=(modes, inputs))
    rows = rng.normal(size=(outputs, modes))
    collocated = min(inputs, outputs)
    rows[:collocated] += drive.T[:collocated] * rng.uniform(0, 3)
    B = np.vstack([np.zeros((modes, inputs)), drive])
    rates = rng.random(outputs) < 0.5
    C = np.hstack([np.where(rates, 0, 1)[:, None] * rows, np.where(rates, 1, 0)[:, None] * rows])
    return control.StateSpace(A, B, C, 0)


def lqg_controller(rng: np.random.Generator, plant: control.StateSpace) -> control.StateSpace:
    """Return an LQG controller of random effort for the plant, to be connected with a plus sign."""
    A, B, C = (np.asarray(getattr(plant, name)) for name in "ABC")
    weight, noise = 10 ** rng.uniform(-2, 2, 2)
    Q, W = C.T @ C, B @ B.T
    K = B.T @ solve_continuous_are(A, B, Q, weight * np.eye(B.shape[1])) / weight
    Kf = solve_continuous_are(A.T, C.T, W, noise * np.eye(len(C))) @ C.T / noise
    return control.StateSpace(A - B @ K - Kf @ C, Kf, -K, 0)


def stable_multiloops(
    seed: int, count: int, channels: int = 2, modes: tuple[int, int] = (2, 12)
) -> Iterator[control.StateSpace]:
    """Yield return ratios, stable when closed: channels unlike each other in gain."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        plant = flexible_plant(rng, int(rng.integers(*modes)), channels, channels)
        controller = lqg_controller(rng, plant)
        loop = -(controller * plant) if rng.random() < 0.5 else -(plant * controller)
        scale = 10 ** rng.uniform(-2, 2, channels)
        yield control.StateSpace(
            loop.A, np.asarray(loop.B) / scale, scale[:, None] * np.asarray(loop.C), 0
        )


def mu_of_two(M: NDArray[np.complex128]) -> Array:
    """Return μ of 2×2 matrices, shape (k, 2, 2), for two complex scalars, in closed form.

    Scaling keeps the determinant, and makes the sum of squares of the two singular values as
    small as |m₁₁|² + |m₂₂|² + 2|m₁₂m₂₁|.
    """
    squares = (
        np.abs(M[:, 0, 0]) ** 2 + np.abs(M[:, 1, 1]) ** 2 + 2 * np.abs(M[:, 0, 1] * M[:, 1, 0])
    )
    both = np.abs(M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0])
    return np.sqrt((squares + np.sqrt(np.maximum(squares**2 - 4 * both**2, 0))) / 2)


def matrices_of(
    loop: control.StateSpace, omega: Array, skew: float = 0.0
) -> NDArray[np.complex128]:
    """Return S + (σ − 1)/2 at each ω by solving with the full matrices, one at a time.

    With those of the closed loop: at a pole of L the sum 1 + L would be singular to rounding.
    """
    A, B, C, D = (np.asarray(getattr(loop, name)) for name in "ABCD")
    eye, sampled = np.eye(len(D)), loop.isdtime(strict=True)
    gain = np.linalg.inv(eye + D)
    closed = A - B @ gain @ C
    found = []
    for w in omega:
        s = np.exp(1j * w * loop.dt) if sampled else 1j * w
        inside = np.linalg.solve(s * np.eye(len(A)) - closed, B @ gain)
        found.append(gain - gain @ C @ inside + (skew - 1) / 2 * eye)
    return np.array(found)


def brute_force_mu(loop: control.StateSpace, skew: float = 0.0) -> float:
    """Return the largest μ of a two-channel loop from a grid refined at every pole, polished."""
    A, B, C, D = (np.asarray(getattr(loop, name)) for name in "ABCD")
    closed = A - B @ np.linalg.solve(np.eye(len(D)) + D, C)
    poles = np.concatenate([np.linalg.eigvals(A), np.linalg.eigvals(closed)])
    last = np.inf
    if loop.isdtime(strict=True):
        poles, last = np.log(poles.astype(complex)) / loop.dt, np.pi / loop.dt
    poles = poles[poles.imag >= 0]
    spread = np.concatenate([[0], 10 ** np.linspace(-3, 2, 21)])
    around = np.abs(poles.imag)[:, None] + np.abs(poles.real)[:, None] * np.hstack(
        [-spread, spread]
    )
    grid = np.concatenate([around.ravel(), np.geomspace(1e-4, 1e4, 400), [1e-8]])
    # Below, the rigid body's poles are rounding, and so would be L.
    grid = np.unique(grid[(grid >= 1e-8) & (grid < last)])

    def height(omega: Array) -> Array:
        return mu_of_two(matrices_of(loop, np.atleast_1d(omega), skew))

    heights = height(grid)
    best = float(heights.max())
    for k in np.argsort(-heights)[:5]:
        low, high = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
        found = minimize_scalar(
            lambda w: -float(height(w)[0]), bounds=(low, high), method="bounded",
            options={"xatol": 1e-12 * high},
        )  # fmt: skip
        best = max(best, -float(found.fun))
    return best
