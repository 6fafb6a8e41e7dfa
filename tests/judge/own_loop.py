"""A controller's matrices closed around finite elements, and what its eigenvalues say.

The state is [ω_k η_k; η̇_k] of the flexible modes and [η, η̇] of the rigid one; the controller
is connected with a plus sign.  Sampled: the torque is held by an exponential of the plant, and
what was computed and has not reached the arm yet are further states.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from finite_elements import Elements
from scipy.linalg import block_diag, expm
from scipy.optimize import brentq

Array = np.ndarray

# A pole this near to the axis (to the unit circle), relative, is neither left nor right of it.
ON_AXIS = 1e-9


@dataclass(frozen=True, eq=False)
class Law:
    """A controller's matrices from its sensors, in this order, to the actuator.

    Attributes
    ----------
    sample_time, delay : float
        In s; 0 for a continuous one.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    sensors: tuple[str, ...]
    actuator: str
    sample_time: float = 0.0
    delay: float = 0.0


@dataclass(frozen=True, eq=False)
class Plant:
    """An arm's first modes, or all of them, with an actuator and sensors."""

    A: Array
    B: Array
    C: Array
    torque: Array  # a torque on the hub, whatever the actuator


def damping(found: Elements, kept: int) -> Array:
    """Return the modal damping matrix of the rigid mode and `kept` − 1 flexible ones."""
    arm, omega = found.arm, found.omega[:kept]
    given = np.atleast_1d(np.asarray(arm.damping_ratio, dtype=float))
    ratios = given[np.minimum(np.arange(kept - 1), len(given) - 1)]
    D = np.diag(np.concatenate([[0.0], 2 * ratios * omega[1:]]))
    if arm.damping is not None:
        law = arm.damping
        if hasattr(law, "retardation_time"):
            D += np.diag(law.retardation_time * omega**2)
        else:
            D += np.diag(law.alpha + law.beta * omega**2)
    return D + arm.hub.friction * np.outer(found.theta[:kept], found.theta[:kept])


def outputs(found: Elements, kept: int, name: str) -> Array:
    """Return the row of the state that a sensor shows."""
    omega = found.omega[:kept]
    scale = np.concatenate([[1.0], 1 / omega[1:]])  # from the state to η
    nothing = np.zeros(kept)
    reach = found.arm.hub.radius + found.arm.beam.length
    kind, _, station = name.partition("@")
    if station:
        x = float(station[:-2]) / (1e3 if station.endswith("mm") else 1e6)
        row = found.moment(x) if kind == "moment" else found.deflection(x)
        return np.concatenate([row[:kept] * scale, nothing])
    theta, tip = found.theta[:kept], found.tip[:kept]
    if name in ("theta_dot", "tip_dot"):
        return np.concatenate([nothing, theta if name == "theta_dot" else tip])
    shown = {"theta": theta, "tip": tip, "tip_deflection": tip - reach * theta}
    row = found.moment(0.0)[:kept] if name == "root_moment" else shown[name]
    return np.concatenate([row * scale, nothing])


def plant(found: Elements, modes: int | None, law: Law) -> Plant:
    """Return the plant of the first `modes` flexible modes, or of all that the elements have."""
    kept = len(found.omega) if modes is None else modes + 1
    omega, theta = found.omega[:kept], found.theta[:kept]
    D, force = damping(found, kept), 1.0
    if law.actuator == "voltage":
        m = found.arm.motor
        force = m.gear_efficiency * m.gear_ratio * m.motor_efficiency * m.torque_constant
        force /= m.resistance
        D = D + force * m.gear_ratio * m.back_emf_constant * np.outer(theta, theta)
    rates = np.diag(np.concatenate([[1.0], omega[1:]]))
    A = np.block([[np.zeros((kept, kept)), rates], [-np.diag(omega), -D]])
    torque = np.concatenate([np.zeros(kept), theta])[:, None]
    C = np.vstack([outputs(found, kept, name) for name in law.sensors])
    return Plant(A, force * torque, C, torque)


@dataclass(frozen=True, eq=False)
class OwnLoop:
    """A law around a plant."""

    plant: Plant
    law: Law

    @cached_property
    def path(self) -> tuple[Array, Array, Array]:
        """(A, B, C) from the actuator to the sensors on the controller's clock."""
        p, T = self.plant, self.law.sample_time
        if not T:
            return p.A, p.B, p.C
        samples = self.law.delay / T
        whole = math.floor(samples + 1e-9)
        part = max(self.law.delay - whole * T, 0.0)
        part = 0.0 if part < 1e-9 * T else part
        waiting = whole + (part > 0)
        n = len(p.A)
        early_x, early_u = held(p.A, p.B, part)
        late_x, late_u = held(p.A, p.B, T - part)
        # u_k, u_{k−1}, …: the one `whole` steps back acts late, the one before it early.
        weights = np.zeros((n, waiting + 1))
        weights[:, whole : whole + 1] += late_u
        if part > 0:
            weights[:, whole + 1 : whole + 2] += late_x @ early_u
        A = np.zeros((n + waiting, n + waiting))
        A[:n, :n] = late_x @ early_x
        A[:n, n:] = weights[:, 1:]
        B = np.zeros((n + waiting, 1))
        B[:n] = weights[:, :1]
        if waiting:
            B[n] = 1.0
            A[n + 1 :, n:-1] = np.eye(waiting - 1)
        return A, B, np.hstack([p.C, np.zeros((len(p.C), waiting))])

    def matrix(self, gain: complex = 1.0) -> Array:
        """Return the closed loop's matrix with the actuator's signal times `gain`."""
        (A, B, C), k = self.path, self.law
        return np.block([[A + gain * B @ k.D @ C, gain * B @ k.C], [k.B @ C, k.A]])

    def poles(self, gain: complex = 1.0) -> Array:
        """Return the closed loop's poles, in the z-plane if it is sampled."""
        return np.linalg.eigvals(self.matrix(gain))

    def beyond(self, gain: complex = 1.0) -> float:
        """Return how far beyond the axis or circle the worst pole is, relative to itself."""
        poles = self.poles(gain)
        if self.law.sample_time:
            return float(np.abs(poles).max() - 1)
        size = np.maximum(np.abs(poles), np.finfo(float).tiny)
        return float((poles.real / size).max())

    @cached_property
    def verdict(self) -> str:
        """``stable``, ``unstable`` or, within rounding of the axis, ``on the axis``."""
        beyond = self.beyond()
        if abs(beyond) <= ON_AXIS:
            return "on the axis"
        return "stable" if beyond < 0 else "unstable"


def held(A: Array, B: Array, h: float) -> tuple[Array, Array]:
    """Return (e^{Ah}, ∫₀ʰ e^{At}B dt)."""
    n = len(A)
    whole = expm(np.block([[A, B], [np.zeros((1, n + 1))]]) * h)
    return whole[:n, :n], whole[:n, n:]


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
    return _over_a_sample(p, Z, rows, effort, pushed, T, k.delay)


def _over_a_sample(p: Plant, Z: Array, rows: Array, effort: float, pushed: Array, T: float,
                   delay: float) -> float:  # fmt: skip
    """Return the mean of Σ z² over a sample from the covariance of [x; waiting…; u] at its start."""
    n = len(p.A)
    whole = math.floor(delay / T + 1e-9)
    part = max(delay - whole * T, 0.0)
    part = 0.0 if part < 1e-9 * T else part
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
    gains = [g for g in gains if 1e-9 < g < 1e9 and _switches(loop, g)]
    angles = []
    level = np.log(np.abs(L))
    for i in np.flatnonzero(level[:-1] * level[1:] <= 0):
        w = _polished(lambda w: math.log(abs(ratio(w))), grid[i], grid[i + 1])
        angles.append(abs(np.degrees(np.angle(-ratio(w)))))
    up = min((g for g in gains if g > 1), default=math.inf)
    down = max((g for g in gains if g < 1), default=0.0)
    return BruteMargins(up, 1 / down if down else math.inf, min(angles, default=math.inf))


def _polished(f: Callable[[float], float], a: float, b: float) -> float:
    return (
        a if f(a) == 0 else b if f(b) == 0 else float(brentq(f, a, b, xtol=1e-15 * b, rtol=1e-14))
    )


def _switches(loop: OwnLoop, gain: float) -> bool:
    """Whether the number of poles beyond the axis changes at this gain."""
    inside, outside = (_unstable(loop, gain * f) for f in (1 - 1e-5, 1 + 1e-5))
    return inside != outside


def _unstable(loop: OwnLoop, gain: float) -> int:
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
