"""Random loops that are not modal: companion forms, fast lags, wide time scales, names, signs.

An arm in modal states under a PID controller with lags and notches, multiplied out.  Every
double is a rational number, so that stability and every crossing are known exactly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import control
import numpy as np
from exact_rational import ExactLoop, fraction, gain_crossings, real_crossings, stable
from flint import acb, acb_poly, ctx
from numpy.typing import NDArray
from scipy.linalg import block_diag

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
KINDS = ("modal", "companion", "lags", "scales")
# Poles over twelve decades; and PID controllers with lags up to 1e6 times as fast.
HARDER = ("decades", "pid")


@dataclass(frozen=True, eq=False)
class MixedLoop:
    """A plant and a controller, connected with `sign` once their signals are in one order.

    Attributes
    ----------
    plant, controller : control.StateSpace
        As they are given to the code under test: named, in any order.
    loop : control.StateSpace
        L for negative feedback, its products rounded.
    exact : ExactLoop
        L for negative feedback, of `plant` and `controller` as they are.
    """

    kind: str
    plant: control.StateSpace
    controller: control.StateSpace
    sign: int
    loop: control.StateSpace
    exact: ExactLoop

    @property
    def stable(self) -> bool:
        return stable(self.exact)

    @cached_property
    def gain_crossings(self) -> Array:
        return gain_crossings(self.exact)

    def logarithms(self, omega: Array) -> tuple[ComplexArray, ComplexArray]:
        """Return log(−L) at each ω and its slope in ω, from exact polynomials in 300 bits.

        A crossing at ω is not exactly there, where ω is a double: beside a pole that is damped
        by 1e-4 the phase of L changes by 1e4 of what is missing.
        """
        before, ctx.prec = ctx.prec, 300
        try:
            up, down = (acb_poly([acb(c) for c in p.coeffs()]) for p in fraction(self.exact))
            up1, down1 = up.derivative(), down.derivative()
            logs, slopes = [], []
            for w in omega.tolist():
                s, turning = self._point(w)
                logs.append(complex((-up(s) / down(s)).log()))
                slopes.append(complex((up1(s) / up(s) - down1(s) / down(s)) * turning))
            return np.array(logs, dtype=complex), np.array(slopes, dtype=complex)
        finally:
            ctx.prec = before

    def _point(self, omega: float) -> tuple[acb, acb]:
        """Return s and ds/dω."""
        step = self.exact.step
        if not step:
            return acb(0, omega), acb(0, 1)
        half = (acb(omega) * acb(step) / 2).tan()
        return acb(0, 1) * half, acb(0, step) / 2 * (1 + half * half)

    @property
    def gain_limits(self) -> tuple[float, float]:
        """Largest factor below one and smallest above, at which a pole lies on the axis."""
        up, down = fraction(self.exact)
        logs, slopes = self.logarithms(real_crossings(self.exact))
        negative = np.abs(logs.imag) < 1  # where L is positive it is half a turn
        logs, slopes = logs[negative], slopes[negative]
        factors = np.exp(-(logs.real - logs.imag * slopes.real / slopes.imag))
        if down.coeffs()[0] != 0 and float(up[0] / down[0]) < 0:
            factors = np.append(factors, -1 / float(up[0] / down[0]))
        return max(factors[factors < 1], default=0.0), min(factors[factors >= 1], default=np.inf)

    @property
    def phase_and_delay(self) -> tuple[float, float]:
        """Smallest turn in rad, and smallest delay in s."""
        omega = self.gain_crossings
        logs, slopes = self.logarithms(omega)
        turns = logs.imag - logs.real * slopes.imag / slopes.real
        late = np.mod(turns, 2 * np.pi) / omega
        return float(np.abs(turns).min(initial=np.inf)), float(late.min(initial=np.inf))


def _arm(rng: np.random.Generator, kind: str) -> tuple[control.StateSpace, Array]:
    """Return θ and θ̇ of a rigid body and a few modes, and the frequencies of the modes."""
    n = int(rng.integers(1, 6))
    if kind == "decades":
        omega = np.sort(10 ** rng.uniform(-5, 6, n))
    else:
        most = 1.3 if kind == "scales" else 0.5
        omega = 10 ** (rng.uniform(-1, 2) + np.cumsum(rng.uniform(0.15, most, n)))
    zeta = 10 ** rng.uniform(-4, -1.7, n)
    residues = rng.uniform(0.05, 2.0, n) * (rng.choice([-1.0, 1.0], n) if rng.random() < 0.3 else 1)
    blocks = [np.array([[0.0, 1.0], [0.0, 0.0]])]
    blocks += [np.array([[0.0, w], [-w, -2 * z * w]]) for w, z in zip(omega, zeta, strict=True)]
    B, C = np.zeros((2 * n + 2, 1)), np.zeros((2, 2 * n + 2))
    B[1::2, 0] = np.sqrt(np.concatenate([[1.0], np.abs(residues)]))
    C[1, 1::2] = B[1::2, 0] * np.concatenate([[1.0], np.sign(residues)])
    C[0, ::2] = C[1, 1::2] / np.concatenate([[1.0], omega])
    return control.StateSpace(block_diag(*blocks), B, C, 0), omega


def _controller(
    rng: np.random.Generator, omega: Array, kind: str, two: bool
) -> tuple[control.StateSpace, float]:
    """Return a PID controller with lags and notches in companion form, and its bandwidth."""
    wb = omega[0] * float(10 ** rng.uniform(-2, 0.3))
    fastest = 6.0 if kind in ("lags", *HARDER) else 2.0
    lags = wb * 10 ** rng.uniform(0.7, fastest, int(rng.integers(1, 4)))
    den, common = np.poly(-lags), float(np.prod(lags))
    kp, kd = common * wb**2, common * 1.4 * wb
    first = np.array([kp]) if two else np.array([kd, kp])
    second = np.array([kd])
    if rng.random() < 0.5:  # integral action
        ki = np.array([0.3 * wb * kp])
        den, first = np.append(den, 0.0), np.polyadd(np.append(first, 0.0), ki)
        second = np.append(second, 0.0)
    for w in omega[: int(rng.integers(0, 3))]:
        den = np.polymul(den, [1.0, 1.4 * w, w**2])
        first, second = (np.polymul(p, [1.0, 0.1 * w, w**2]) for p in (first, second))
    n = len(den) - 1
    ups = [np.pad(p, (n + 1 - len(p), 0)) for p in ((first, second) if two else (first,))]
    A = np.eye(n, k=1)
    A[:, 0] = -den[1:]
    B = np.column_stack([p[1:] - p[0] * den[1:] for p in ups])
    D = np.array([[p[0] for p in ups]])
    return control.StateSpace(A, B, np.eye(n)[:1], D), wb


def _balanced_states(system: control.StateSpace) -> control.StateSpace:
    """Return the same in modal states where it has them: what a design method would give."""
    values, T = np.linalg.eig(system.A)
    if np.iscomplexobj(values) or np.linalg.cond(T) > 1e8:
        return system
    inverse = np.linalg.inv(T)
    return control.StateSpace(np.diag(values), inverse @ system.B, system.C @ T, system.D)


def random_mixed_loop(rng: np.random.Generator, kind: str) -> MixedLoop:
    """Return a random loop, stable or not, of one of `KINDS` or `HARDER`."""
    G, omega = _arm(rng, kind)
    two = bool(rng.random() < 0.5)
    G = G if two else G[0, 0]
    K, _ = _controller(rng, omega, kind, two)
    if kind == "modal":
        K = _balanced_states(K)
    sign = int(rng.choice([-1, 1]))
    A = np.block([[G.A, np.zeros((G.nstates, K.nstates))], [K.B @ G.C, K.A]])
    loop = control.StateSpace(
        A, np.vstack([G.B, K.B @ G.D]), np.hstack([K.D @ G.C, K.C]), K.D @ G.D
    )
    sensors = ["theta", "theta_dot"][: 1 + two]
    order = rng.permutation(len(sensors))
    plant = control.StateSpace(
        G.A, G.B, G.C[order], G.D[order], inputs=["torque"], outputs=[sensors[i] for i in order]
    )
    controller = control.StateSpace(
        K.A, K.B, -sign * K.C, -sign * K.D, inputs=sensors, outputs=["torque"]
    )
    return MixedLoop(kind, plant, controller, sign, loop, ExactLoop.in_series(G, K))


def random_mixed_loops(seed: int, count: int) -> Iterator[MixedLoop]:
    """Yield `count` random loops of all kinds in turn."""
    rng = np.random.default_rng(seed)
    for index in range(count):
        yield random_mixed_loop(rng, KINDS[index % len(KINDS)])
