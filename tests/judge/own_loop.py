"""A controller's matrices closed around finite elements, and what its eigenvalues say.

The state is [ω_k η_k; η̇_k] of the flexible modes and [η, η̇] of the rigid one; the controller
is connected with a plus sign.  Sampled: the torque is held by an exponential of the plant, and
what was computed and has not reached the arm yet are further states.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from finite_elements import Elements
from scipy.linalg import expm

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

    @property
    def late(self) -> tuple[int, float]:
        """The delay in whole samples, and what is left of it in s."""
        whole = math.floor(self.delay / self.sample_time + 1e-9)
        part = self.delay - whole * self.sample_time
        return whole, part if part > 1e-9 * self.sample_time else 0.0


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
        whole, part = self.law.late
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
