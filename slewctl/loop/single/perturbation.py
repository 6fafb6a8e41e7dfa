"""The smallest change of a loop that makes it unstable, applied and looked at.

Each margin is reached by a change that can be written down: a gain, a turn, a delay, or for
the modulus and the disk a small real-rational filter with just the worst value at the worst
frequency.  The loop is closed with it, and its pole nearest to the critical point recomputed
from a state matrix: it must lie on the axis, or the unit circle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.given_system import static
from slewctl.numerics.interconnect import parallel, series
from slewctl.numerics.linear_system import LinearSystem, holding_light

if TYPE_CHECKING:
    import control

# Nearer to zero than this, 1 + D has no inverse, and no pole is where it should be.
_POSED = 1e-12
Kind = Literal["gain", "phase", "delay", "modulus", "disk"]


@holding_light
@dataclass(frozen=True, eq=False)
class Perturbation:
    """A change of the loop that puts a closed-loop pole on the stability limit.

    Attributes
    ----------
    kind : {"gain", "phase", "delay", "modulus", "disk"}
        The factor of L is a real gain; e^(jφ); e^(−jωτ), that of a delay at ω; for the disk
        a filter.  For the modulus a filter is added to L.
    value : complex
        Of the factor (modulus: of what is added) at the critical frequency.
    system : control.StateSpace or None
        The factor, or the added filter, as a real system; None for a turn and a delay,
        which no real-rational system is at all frequencies.
    pole : complex
        The pole of the changed closed loop that is nearest to the critical point, in rad/s,
        or in the z plane for a sampled loop.
    distance : float
        How far from the axis it lies, relative to its size (sampled: from the unit circle,
        relative to |z − 1|).
    """

    kind: Kind
    value: complex
    system: control.StateSpace | None
    pole: complex
    distance: float


class Changed:
    """Changes of one loop, worked out only when somebody looks at them."""

    def __init__(self, loop: LinearSystem) -> None:
        self.loop = loop

    @cached_property
    def broken(self) -> BrokenLoop:
        """The loop, ready to be closed with factors."""
        return BrokenLoop(self.loop)

    def by(self, kind: Kind, factor: complex, omega: float) -> Change:
        """Return one change; the factor of a disk is its skew."""
        return Change(self, kind, factor, omega)


@dataclass(frozen=True, eq=False)
class Change:
    """A change of a loop that has not been applied yet."""

    changed: Changed
    kind: Kind
    factor: complex
    omega: float

    @property
    def applied(self) -> Perturbation | None:
        """The change, and where it puts a pole."""
        loop = self.changed.broken
        if self.kind == "gain":
            return gain(loop, self.factor.real, self.omega)
        if self.kind == "modulus":
            return added(loop, self.omega)
        if self.kind == "disk":
            return filtered(loop, self.factor.real, self.omega)
        return turned(loop, self.kind, self.factor, self.omega)


def gain(loop: BrokenLoop, factor: float, omega: float) -> Perturbation:
    """Return the loop with its gain multiplied by `factor`."""
    change = static(factor, _dt(loop))
    return _seen(loop, "gain", factor, change, loop.closed_poles(factor), omega)


def turned(loop: BrokenLoop, kind: Kind, factor: complex, omega: float) -> Perturbation:
    """Return the loop turned by a factor of modulus one at ω: a phase, or a delay."""
    return _seen(loop, kind, factor, None, loop.closed_poles(factor), omega)


def added(loop: BrokenLoop, omega: float) -> Perturbation | None:
    """Return the loop with the smallest filter added that makes 1 + L zero at ω."""
    value = -1 - complex(loop.response(np.array([omega]))[0]) if np.isfinite(omega) else np.inf
    if not np.isfinite(value) or not len(loop.A):
        return None
    change = _all_pass(loop, value, omega)
    changed = BrokenLoop(parallel(loop.system, change))
    if abs(1 + changed.D) < _POSED:
        return None
    return _seen(loop, "modulus", value, change, changed.poles, omega)


def filtered(loop: BrokenLoop, skew: float, omega: float) -> Perturbation | None:
    """Return the loop with the worst filter of the critical disk in it.

    None where the disk is reached only by an infinite gain, where L vanishes.
    """
    if not np.isfinite(omega) or not len(loop.A):
        return None
    L = complex(loop.response(np.array([omega]))[0])
    if not np.isfinite(L):
        return None
    more, less = (1 - skew) / 2, (1 + skew) / 2
    if abs(L) < 1e-6 or abs(less - more * L) < 1e-6:
        return None
    delta = _all_pass(loop, (1 + L) / (less - more * L), omega)
    room = 1 - less * float(delta.D[0, 0])
    if room == 0:
        return None
    # f = 1 + δ/(1 − δ(1 + σ)/2)
    change = LinearSystem(
        delta.A + delta.B @ delta.C * (less / room),
        delta.B / room,
        delta.C / room,
        1 + delta.D / room,
        _dt(loop),
    )
    changed = BrokenLoop(series(change, loop.system))
    if abs(1 + changed.D) < _POSED:
        return None
    return _seen(loop, "disk", -1 / L, change, changed.poles, omega)


def _dt(loop: BrokenLoop) -> float:
    return loop.step or 0


def _all_pass(loop: BrokenLoop, value: complex, omega: float) -> LinearSystem:
    """Return a real all-pass system of first order that has `value` at ω.

    c(s − a)/(s + a), with s = (z − 1)/(z + 1) for a sampled loop.
    """
    v = np.tan(omega * loop.step / 2) if loop.step else omega
    angle = float(np.angle(value))
    at_end = omega == 0 or (loop.step and omega * loop.step > np.pi * (1 - 1e-12))
    if at_end or abs(np.sin(angle)) < 1e-12:
        return static(value.real, _dt(loop))
    c = abs(value) if angle > 0 else -abs(value)
    turn = angle if angle > 0 else angle + np.pi
    a = v / np.tan((np.pi - turn) / 2)
    if not loop.step:
        return LinearSystem(-a, 1.0, -2 * a * c, c, 0)
    pole = (1 - a) / (1 + a)
    return LinearSystem(pole, 1.0, c * (pole**2 - 1), c * pole, loop.step)


def _seen(
    loop: BrokenLoop,
    kind: Kind,
    value: complex,
    system: LinearSystem | None,
    poles: np.ndarray,
    omega: float,
) -> Perturbation:
    """Return the perturbation with the pole that it puts on the limit."""
    point = complex(loop.points(np.array([omega]))[0])
    if not len(poles):
        return Perturbation(kind, complex(value), system, complex(np.nan), np.inf)
    # A turned loop is complex: its pole may lie at −jω.
    pole = complex(poles[np.argmin(np.abs(poles - point))])
    slowest = float(np.abs(loop.poles).min(initial=np.inf))
    size = max(abs(point), slowest) if np.isfinite(slowest) else abs(point)
    distance = abs(float(loop.growth(np.array([pole]))[0])) / (size or 1.0)
    return Perturbation(kind, complex(value), system, pole + (1 if loop.step else 0), distance)
