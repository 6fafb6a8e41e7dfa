"""Which mode of an arm an unstable loop has destabilised.

The modes that the design neglected are brought in gradually: with their coupling to the
rest of the loop scaled by t their residues grow like t², and at t = 0 each of them
vibrates alone, beside the loop of the kept modes.  The unstable closed-loop pole is
followed from t = 1 back to t = 0, where it belongs to one of them, or to that loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, check_count
from slewctl.loop import Loop
from slewctl.numerics.interconnect import closed_matrix
from slewctl.numerics.matrix_equations import stability_threshold
from slewctl.numerics.modes import Eigensystem

# A pole has been followed when it is this many times nearer to where it was expected than
# any other pole; else the step is halved.
_CLEARLY = 4.0
_STEP = 0.1  # of t, from 1 to 0: the longest
_SMALLEST_STEP = 1e-6  # poles that cannot be told apart by then are not followed
# Uncoupled, a pole is wholly a neglected mode's or not at all.
_OWN = 0.5


@dataclass(frozen=True)
class DestabilisedMode:
    """The open-loop mode that an unstable closed-loop pole belongs to.

    Attributes
    ----------
    number : int
        0 is the rigid-body rotation, 1 the first flexible mode.
    frequency_hz : float
        Of the mode by itself, undamped.
    pole : complex
        The fastest growing closed-loop pole, rad/s.
    neglected : bool
        Whether the design had no state for it.
    method : {"continuation", "participation"}
        How it was found: by following the pole back to a neglected mode, or, where it does
        not come from one or could not be followed, or the loop of the kept modes alone is
        unstable already, as the mode with the largest share in the unstable motion.
    participation : float
        Share of the mode's own states in the unstable closed-loop mode, 0 to 1.
    separation : float or None
        Smallest distance to another pole on the way, relative to the pole's magnitude.
        Where it is small two modes were lost together, and which of them the pole is said
        to belong to is a matter of rounding; None without continuation.
    """

    number: int
    frequency_hz: float
    pole: complex
    neglected: bool
    method: Literal["continuation", "participation"]
    participation: float
    separation: float | None

    def __str__(self) -> str:
        return self._text(" (neglected)" if self.neglected else " (kept)")

    @property
    def place(self) -> str:
        """Mode and pole in words, without whether the design knew the mode."""
        return self._text("")

    def _text(self, kind: str) -> str:
        name = f"mode {self.number}" if self.number else "the rigid-body rotation"
        turning = f" ± {abs(self.pole.imag):.4g}j" if self.pole.imag else ""
        return (
            f"{name} at {self.frequency_hz:.4g} Hz{kind}, as a pole at "
            f"{self.pole.real:.3g}{turning} rad/s"
        )


def destabilised_mode(loop: Loop, kept: int | None = None) -> DestabilisedMode | None:
    """Return which open-loop mode an unstable loop has destabilised; None for a stable one.

    Parameters
    ----------
    loop : Loop
    kept : int, optional
        Flexible modes that the design knew; by default as many as the controller has states
        for beside the rigid body's two.

    Returns
    -------
    DestabilisedMode or None
        For the fastest growing pole.

    Raises
    ------
    InputError
        If `kept` is not a whole number, or the controller is sampled.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> loop = problem.judge(sc.lqg(plant)).loop
    >>> from slewctl.compare import destabilised_mode
    >>> destabilised_mode(loop) is None  # of a stable loop
    True
    """
    system = loop.controller.linear
    if system.sample_time:
        raise InputError(
            "the controller is sampled, its poles do not belong to modes of the arm",
            where="destabilised_mode",
            remedy="ask for the continuous controller that it was made of",
        )
    if kept is None:
        kept = max(system.nstates // 2 - 1, 0)
    kept = min(check_count(kept, "kept", 0), loop.model.n)
    if loop.stable:
        return None
    parts = _Parts.of(loop, kept)
    pole = loop.poles[np.argmax(loop.poles.real)]
    pole = complex(pole.real, abs(pole.imag))
    shares = parts.participation(parts.at(1.0), pole)
    number, separation = int(np.argmax(shares)), None
    method: Literal["continuation", "participation"] = "participation"
    origin = _followed_back(parts.at, pole) if _stable(parts.at(0.0)) else None
    if origin is not None:
        before = parts.participation(parts.at(0.0), origin.pole)
        # A pole of the kept modes' loop is of no single mode; one of a neglected mode is.
        if before[kept + 1 :].sum() > _OWN:
            number, method = kept + 1 + int(np.argmax(before[kept + 1 :])), "continuation"
            separation = origin.separation
    return DestabilisedMode(
        number=number,
        frequency_hz=float(loop.model.frequencies_hz[number - 1]) if number else 0.0,
        pole=pole,
        neglected=number > kept,
        method=method,
        participation=float(shares[number]),
        separation=separation,
    )


@dataclass(frozen=True, eq=False)
class _Parts:
    """The closed loop as a function of how strongly the neglected modes are coupled to it.

    Attributes
    ----------
    modes : ndarray of int
        The mode of each state of the closed loop; −1 for the controller's.
    """

    A: Array
    B: Array
    C: Array
    controller: tuple[Array, Array, Array, Array]
    modes: Array
    kept: int

    @classmethod
    def of(cls, loop: Loop, kept: int) -> _Parts:
        path, K = loop.plant.path, loop.controller.linear
        own = np.tile(np.arange(loop.model.n + 1), 2)
        lags = len(path.A) - len(own)  # of actuator and sensors, on the controller's side
        return cls(
            np.asarray(path.A),
            np.asarray(path.B),
            np.asarray(path.C),
            K.matrices,
            np.concatenate([own, np.full(lags + K.nstates, -1)]),
            kept,
        )

    def at(self, t: float) -> Array:
        """Return the closed loop's state matrix: the truth at t = 1, uncoupled at t = 0."""
        own = self.modes[: len(self.A)]
        scale = np.where(own > self.kept, t, 1.0)
        alone = own[:, None] == own[None, :]
        A = np.where(alone, self.A, self.A * np.outer(scale, scale))
        B, C = self.B * scale[:, None], self.C * scale
        return closed_matrix(A, B, C, self.controller)

    def participation(self, matrix: Array, pole: complex) -> Array:
        """Return the share of each mode of the arm, rigid body first, in a pole of `matrix`.

        The participation factor of state i is |w_i v_i| with the left and right eigenvector
        (Pérez-Arriaga, Verghese and Schweppe, IEEE Trans. Power App. Syst. 101, 1982).
        """
        found = Eigensystem.of(matrix)
        k = int(np.argmin(np.abs(found.poles - pole)))
        each = np.abs(found.left[k] * found.right[:, k])
        return np.bincount(self.modes + 1, each)[1:] / each.sum()


def _stable(matrix: Array) -> bool:
    # The rigid body and undamped modes that nothing holds yet lie on the axis itself.
    return bool(np.linalg.eigvals(matrix).real.max() < stability_threshold(matrix))


@dataclass(frozen=True)
class _Origin:
    """Where a pole comes from, and how near another one it passed, relative."""

    pole: complex
    separation: float


def _followed_back(matrix: Callable[[float], Array], start: complex) -> _Origin | None:
    """Return where a pole of matrix(1) comes from at t = 0; None where it cannot be told.

    Each step is predicted by dλ/dt = wᴴA'v/wᴴv; `matrix` is quadratic in t.
    """
    constant, plus, minus = matrix(0.0), matrix(1.0), matrix(-1.0)
    linear, quadratic = (plus - minus) / 2, (plus + minus) / 2 - constant
    t, step, closest = 1.0, _STEP, np.inf
    here = Eigensystem.of(plus)
    k = int(np.argmin(np.abs(here.poles - start)))
    while t > 0:
        reach = min(step, t)
        slope = here.rows[k] @ (linear + 2 * t * quadratic) @ here.columns[:, k]
        expected = here.poles[k] - reach * slope
        found = Eigensystem.of(matrix(t - reach))
        distances = np.abs(found.poles - expected)
        nearest, second = np.argsort(distances)[:2]
        if distances[nearest] * _CLEARLY <= distances[second]:
            t -= reach
            here, k = found, int(nearest)
            pole = here.poles[k]
            apart = np.partition(np.abs(here.poles - pole), 1)[1]
            apart = apart / abs(pole) if pole else 0.0  # the rigid body's two poles are one
            closest = min(closest, float(apart))
            step = min(2 * step, _STEP)
        elif reach <= _SMALLEST_STEP:
            return None
        else:
            step = reach / 2
    return _Origin(complex(here.poles[k]), closest)
