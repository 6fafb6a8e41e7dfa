"""The cost of a sampled loop by brute force: sixty-four exact steps a sample, step by step."""

from __future__ import annotations

import control
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_lyapunov

from slewctl import GeneralisedPlant

Array = NDArray[np.float64]
STEPS = 64


def brute_force(
    plant: GeneralisedPlant, K: control.StateSpace, T: float, delay_steps: int
) -> tuple[float, float]:
    """Return the mean of zᵀz over all times, and the spectral radius of one sample.

    The delay is a number of steps of T/64.  The states [x; the input that acts; the queue of
    inputs computed; the controller's] pass through one event after the other.
    """
    n, nk, ny = len(plant.A), K.nstates, len(plant.sensors)
    whole, part = divmod(delay_steps, STEPS)
    queue = whole + 1
    size = n + 1 + queue + nk
    x, u, q, k = slice(0, n), n, slice(n + 1, n + 1 + queue), slice(n + 1 + queue, size)
    read, entering = np.eye(size), np.zeros((size, ny))
    read[q] = np.eye(queue, queue, -1) @ read[q]
    read[n + 1] = 0
    read[n + 1, k], read[n + 1, x] = K.C[0], (K.D @ plant.C2)[0]
    read[k, x], read[k, k] = K.B @ plant.C2, K.A
    entering[n + 1], entering[k] = K.D[0], K.B
    act = np.eye(size)
    act[u] = np.eye(size)[n + queue]
    h = T / STEPS
    whole_A = np.zeros((size, size))
    whole_A[x, x], whole_A[x, u] = plant.A, plant.B2[:, 0]
    nodes, weights = np.polynomial.legendre.leggauss(8)
    nodes, weights = (nodes + 1) / 2, weights / 2

    def noise(span: float) -> Array:
        """∫ e^(At) B₁B₁ᵀ e^(Aᵀt) dt by Gauss quadrature over a step or less."""
        total = np.zeros((size, size))
        for node, weight in zip(nodes, weights, strict=True):
            column = expm(plant.A * span * node) @ plant.B1
            total[x, x] += span * weight * (column @ column.T)
        return total

    step, added = expm(whole_A * h), noise(h)
    z = np.zeros((plant.performance, size))
    z[:, x], z[:, u] = plant.C1, plant.D12[:, 0]
    V = plant.D21 @ plant.D21.T / T

    def through(P: Array, phi: Array, count: int, *, costing: bool) -> tuple[Array, Array, float]:
        """Carry covariance and transition over so many steps, and integrate E zᵀz."""
        cost = 0.0
        for _ in range(count):
            if costing:
                for (move, grown), weight in zip(inner, weights, strict=True):
                    cost += h * weight * float(np.trace(z @ (move @ P @ move.T + grown) @ z.T))
            P, phi = step @ P @ step.T + added, step @ phi
        return P, phi, cost

    inner = [(expm(whole_A * h * node), noise(h * node)) for node in nodes]

    def sample(P: Array, *, costing: bool) -> tuple[Array, Array, float]:
        P = read @ P @ read.T + entering @ V @ entering.T
        P, phi, first = through(P, read, part, costing=costing)
        P, phi, second = through(act @ P @ act.T, act @ phi, STEPS - part, costing=costing)
        return P, phi, first + second

    Q, phi, _ = sample(np.zeros((size, size)), costing=False)
    radius = float(np.abs(np.linalg.eigvals(phi)).max())
    if radius >= 1:
        return np.inf, radius
    P = solve_discrete_lyapunov(phi, Q)
    return sample(P, costing=True)[2] / T, radius
