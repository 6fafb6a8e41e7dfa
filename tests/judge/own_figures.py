"""Margins and H2 cost of a loop around finite elements, by brute force."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from finite_elements import Elements
from own_loop import Law, OwnLoop, Plant, held, outputs
from scipy.linalg import block_diag, expm
from scipy.optimize import brentq

Array = np.ndarray

# A limit is one if the loop's poles differ at factors this far, relative, on its two sides.
_BESIDE = 1e-5


def h2_cost(loop: OwnLoop, found: Elements, modes: int, limits: Mapping[str, float],
            noise: Mapping[str, float]) -> float:  # fmt: skip
    """Return the stationary mean of Σ z² of a continuous loop without feedthrough, or sampled.

    By the covariance alone: Smith's doubling of the closed loop's own matrix.  Sampled, the
    variance of z is integrated over a sample by Gauss's rule.
    """
    p, k = loop.plant, loop.law
    n, nk = len(p.A), len(k.A)
    names = [name for name in limits if name not in ("torque", "voltage")]
    rows = np.vstack([outputs(found, modes + 1, name) / limits[name] for name in names])
    sensed = np.diag([noise[name] ** 2 for name in k.sensors])
    pushed = noise["torque"] ** 2 * p.torque @ p.torque.T
    effort = 1 / limits[k.actuator]
    if not k.sample_time:
        entering = block_diag(pushed, k.B @ sensed @ k.B.T)
        X = continuous_covariance(loop.matrix(), entering)
        seen = np.vstack([np.hstack([rows, np.zeros((len(rows), nk))]),
                          effort * np.hstack([k.D @ p.C, k.C])])  # fmt: skip
        return float(np.trace(seen @ X @ seen.T))
    T = k.sample_time
    A, B, C = loop.path
    measured = sensed / T
    inlet = np.vstack([B @ k.D, k.B])
    entering = inlet @ measured @ inlet.T
    entering[:n, :n] += noise_of(p.A, pushed, T)
    X = discrete_covariance(loop.matrix(), entering)
    # [x; waiting inputs; u_k] at the instant, the noise of u_k included.
    now = np.vstack([np.hstack([np.eye(len(A)), np.zeros((len(A), nk))]),
                     np.hstack([k.D @ C, k.C])])  # fmt: skip
    direct = np.vstack([np.zeros((len(A), len(C))), k.D])
    Z = now @ X @ now.T + direct @ measured @ direct.T
    return _over_a_sample(p, k, Z, rows, effort, pushed)


def _over_a_sample(p: Plant, law: Law, Z: Array, rows: Array, effort: float,
                   pushed: Array) -> float:  # fmt: skip
    """Return the mean of Σ z² over a sample from the covariance of [x; waiting…; u] at its start."""
    n, T, (whole, part) = len(p.A), law.sample_time, law.late
    waiting = len(Z) - n - 1
    # Positions of u_k, u_{k−1}, … in Z.
    place = [len(Z) - 1, *range(n, n + waiting)]
    old, new = place[min(whole + 1, waiting)], place[whole]
    fastest = float(np.abs(np.linalg.eigvals(p.A)).max())
    total = 0.0
    start = np.eye(n, len(Z))
    for begin, length, acting in ((0.0, part, old), (part, T - part, new)):
        if length == 0:
            continue
        unit = np.eye(len(Z))[[acting]]
        pieces = 1 + int(fastest * length / 4)
        xi, weights = np.polynomial.legendre.leggauss(12)
        for i in range(pieces):
            for s, w in zip((1 + xi) / 2, weights / 2, strict=True):
                t = (i + s) * length / pieces
                x, u = held(p.A, p.B, t)
                map_ = x @ start + u @ unit
                spread = map_ @ Z @ map_.T + noise_of(p.A, pushed, begin + t)
                value = np.trace(rows @ spread @ rows.T)
                value += effort**2 * float((unit @ Z @ unit.T)[0, 0])
                total += w * length / pieces * value
        x, u = held(p.A, p.B, length)
        start = x @ start + u @ unit
    return float(total / T)


def noise_of(A: Array, Q: Array, h: float) -> Array:
    """Return ∫₀ʰ e^{At}Qe^{Aᵀt}dt by Gauss's rule on a short step, then doubled."""
    doublings = max(0, math.ceil(math.log2(max(np.linalg.norm(A, 2) * h, 1e-300))) + 1)
    step = h / 2**doublings
    xi, weights = np.polynomial.legendre.leggauss(10)
    W = sum(
        w * step / 2 * (E := expm(A * step * (1 + x) / 2)) @ Q @ E.T
        for x, w in zip(xi, weights, strict=True)
    )
    E = expm(A * step)
    for _ in range(doublings):
        W, E = W + E @ W @ E.T, E @ E
    return W


def discrete_covariance(A: Array, Q: Array) -> Array:
    """Return Σ AᵏQAᵀᵏ by doubling."""
    X = Q
    for _ in range(60):
        more = A @ X @ A.T
        X, A = X + more, A @ A
        if np.linalg.norm(more) <= 1e-17 * np.linalg.norm(X):
            return X
    raise ArithmeticError("the covariance does not settle")


def continuous_covariance(A: Array, Q: Array) -> Array:
    """Return the solution of AX + XAᵀ + Q = 0 by a Cayley transform and doubling."""
    poles = np.abs(np.linalg.eigvals(A))
    c = math.sqrt(poles.max() * poles[poles > 0].min())
    inverse = np.linalg.inv(c * np.eye(len(A)) - A)
    return discrete_covariance(inverse @ (A + c * np.eye(len(A))), 2 * c * inverse @ Q @ inverse.T)


@dataclass(frozen=True)
class BruteMargins:
    """Factors of the gain up and down, and degrees of phase, to the limit; inf without one."""

    up: float
    down: float
    phase_deg: float


def brute_margins(loop: OwnLoop, points: int = 40) -> BruteMargins:
    """Return the margins of a stable loop: a dense frequency grid, and eigenvalues that decide.

    Crossings of the grid are polished; each limit claimed must put a pole on the axis, and
    fewer or more poles beyond it on its two sides, or it is no limit.
    """
    grid = _frequencies(loop, points)
    L = _return_ratio(loop, grid)

    def ratio(w: float) -> complex:
        return complex(_return_ratio(loop, np.array([w]))[0])

    gains = []
    for i in np.flatnonzero((L.imag[:-1] * L.imag[1:] <= 0) & (L.real[:-1] < 0)):
        w = _polished(lambda w: ratio(w).imag, grid[i], grid[i + 1])
        if ratio(w).real < 0:
            gains.append(-1 / ratio(w).real)
    ends = [0.0, math.pi / loop.law.sample_time] if loop.law.sample_time else [0.0]
    for w in ends:
        value = ratio(max(w, 1e-9 * grid[0]))
        if value.real < 0 and abs(value.imag) < 1e-6 * abs(value.real):
            gains.append(-1 / value.real)
    # A pole at zero makes Im L of rounding where |L| is immense.
    gains = [
        g for g in gains
        if 1e-9 < g < 1e9 and _switches(loop, g * (1 - _BESIDE), g * (1 + _BESIDE))
    ]  # fmt: skip
    angles = []
    level = np.log(np.abs(L))
    for i in np.flatnonzero(level[:-1] * level[1:] <= 0):
        w = _polished(lambda w: math.log(abs(ratio(w))), grid[i], grid[i + 1])
        turn = 1j * np.angle(-1 / ratio(w))
        if _switches(loop, np.exp(turn * (1 - _BESIDE)), np.exp(turn * (1 + _BESIDE))):
            angles.append(abs(float(np.degrees(turn.imag))))
    up = min((g for g in gains if g > 1), default=math.inf)
    down = max((g for g in gains if g < 1), default=0.0)
    return BruteMargins(up, 1 / down if down else math.inf, min(angles, default=math.inf))


def _polished(f: Callable[[float], float], a: float, b: float) -> float:
    return (
        a if f(a) == 0 else b if f(b) == 0 else float(brentq(f, a, b, xtol=1e-15 * b, rtol=1e-14))
    )


def _switches(loop: OwnLoop, inside: complex, outside: complex) -> bool:
    """Whether the number of poles beyond the axis differs between two factors of the loop."""
    return _unstable(loop, inside) != _unstable(loop, outside)


def _unstable(loop: OwnLoop, gain: complex) -> int:
    poles = loop.poles(gain)
    return int(np.sum(np.abs(poles) > 1 if loop.law.sample_time else poles.real > 0))


def _return_ratio(loop: OwnLoop, omega: Array) -> Array:
    """Return L = −K G at frequencies in rad/s."""
    (A, B, C), k = loop.path, loop.law
    s = np.exp(1j * omega * k.sample_time) if k.sample_time else 1j * omega
    shifted = s[:, None, None]
    seen = C @ np.linalg.solve(shifted * np.eye(len(A)) - A, B.astype(complex))
    answer = k.D @ seen
    if len(k.A):
        answer = answer + k.C @ np.linalg.solve(shifted * np.eye(len(k.A)) - k.A, k.B @ seen)
    return -answer[:, 0, 0]


def _frequencies(loop: OwnLoop, points: int) -> Array:
    """Return frequencies that miss nothing within the half-width of any pole, open or closed."""
    T = loop.law.sample_time
    poles = np.concatenate([np.linalg.eigvals(loop.path[0]), np.linalg.eigvals(loop.law.A),
                            loop.poles()])  # fmt: skip
    if T:
        poles = np.log(poles[np.abs(poles) > 1e-12].astype(complex)) / T
    size = np.abs(poles[np.abs(poles) > 0])
    low, high = size[size > 1e-9 * size.max()].min() / 1e3, size.max() * 1e3
    high = math.pi / T if T else high
    parts = [np.geomspace(min(low, high / 1e6), high, 60 * points)]
    for pole in poles[poles.imag > 0]:
        width = max(abs(pole.real), 1e-7 * abs(pole))
        spread = width * np.sinh(np.linspace(-12, 12, 8 * points))
        parts.append(pole.imag + spread)
    grid = np.unique(np.concatenate(parts))
    return grid[(grid > 0) & (grid <= high)]
