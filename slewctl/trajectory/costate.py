"""The fastest bang-bang turn by its costate: full torque with the sign of one function of time.

Among all torques |u| ≤ 1 on [0, T] with ∫f_k u = 0 the largest -∫t u is the least ∫|λ| over
λ = -t + Σ p_k f_k, a convex function of p, and u = sign λ (Pontryagin's maximum principle, of
which this is the dual; Athans and Falb, Optimal Control, 1966, chapter 6).  However often λ
changes its sign, the equations are as many as the multipliers.  That the two agree proves that
no torque does better.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, factorial, pi

import numpy as np

from slewctl._types import Array
from slewctl.errors import AccuracyError
from slewctl.trajectory.shapers import Mode

# Times at which λ is looked at: for each period of the fastest mode, and at least.
_A_PERIOD, _LEAST = 48, 480
# Bisections between two of them: of a zero to the last digit, and of an extreme near zero.
_TO_THE_END, _NEAR = 60, 16
# Newton's steps for the multipliers, and for the time.
_STEPS, _TIMES = 200, 40
# Damping of the former, of the mean curvature: at least, and when no step is left to take.
_DAMPING = 1e-16, 1e3
# What the functionals should leave, of terms of size one, and what they may.
_LEFT, _ENOUGH = 1e-12, 1e-9
# So little is left by rounding of the steps themselves.
_FINE = 1e-10
# A step that does not lower ∫|λ| by more than rounding is taken if less is left by it.
_ROUNDING = 1e-14

# Of a power series within a part of a period: its last is 1/24!.
_TERMS = 22


@dataclass(frozen=True)
class Functionals:
    """The weights f of ∫f u: t, 1, and two (or four) waves of each mode.

    Within a part of a lone mode's period these are hardly different functions; what takes
    their place spans the same, and −∫t u is the same where the others leave nothing.

    Attributes
    ----------
    modes : sequence of Mode
    order : {1, 2}
    since : float
        The time in s at which the waves are of size one; they grow until then.
    """

    modes: Sequence[Mode]
    order: int
    since: float

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return weights, their antiderivatives and their slopes at times t, each a row."""
        one = np.ones_like(t)
        weights, sums, slopes = [t, one], [t**2 / 2, t], [one, 0 * t]
        for mode in self.modes:
            if len(self.modes) == self.order == 1 and mode.frequency * self.since < 1:
                added = _short(mode, t)
                # t less the mode's first weight, which leaves nothing: what is alike goes.
                slopes[0], weights[0], sums[0] = -added[:3]
                whole = added + np.array([one, t, t**2 / 2, t**3 / 6])
                for first, rows in enumerate((slopes, weights, sums)):
                    rows += list(whole[first : first + 2])
                continue
            pole = mode.ratio * mode.frequency + 1j * mode.damped
            late = t - self.since
            wave = np.exp(pole * late)
            made = [
                (wave, wave / pole, pole * wave),
                (late * wave, (late - 1 / pole) * wave / pole, (1 + pole * late) * wave),
            ]
            for part in made[: self.order]:
                for rows, values in zip((weights, sums, slopes), part, strict=True):
                    rows += [values.real, values.imag]
        return np.array(weights), np.array(sums), np.array(slopes)


def _short(mode: Mode, t: Array) -> Array:
    """Return how t⁰, t, t²/2 and t³/6 become others by a mode, within a part of its period.

    With them they are the response of ÿ − 2ζω ẏ + ω² y to an impulse and what its integrals
    are, each the slope of the next.  The second and third of these span the mode's waves.
    """
    damped, stiff = 2 * mode.ratio * mode.frequency, mode.frequency**2
    added, before, last = np.zeros((4, len(t))), 1.0, 0.0
    for power in range(1, _TERMS):
        before, last = damped * before - stiff * last, before
        for k, row in enumerate(added):
            row += before * t ** (power + k) / factorial(power + k)
    return added


class FullTorque:
    """Full torque with the sign of λ, until a time.

    Parameters
    ----------
    functionals : Functionals
    p : ndarray
        Multipliers of all functionals but the first, whose own is −1.
    end : float
        In s.
    """

    def __init__(self, functionals: Functionals, p: Array, end: float) -> None:
        self.functionals, self.end = functionals, end
        self.multipliers = np.append(-1.0, p)
        self.switches = self._crossings()
        marks = np.concatenate([[0.0], self.switches, [end]])
        weights, sums, slopes = functionals.at(marks)
        first = float(np.sign(self._costate(np.array([marks[1] / 2]))[0]))
        self.signs = first * (-1.0) ** np.arange(len(marks) - 1)
        # ∫f u of each functional, and what each is made of.
        self.moments = np.diff(sums, axis=1) @ self.signs
        self.sizes = np.abs(np.diff(sums, axis=1)).sum(axis=1)
        self.reach = float(self.multipliers @ self.moments)
        self.at_end = float(self.multipliers @ weights[:, -1])
        self._weights = weights[1:, 1:-1]
        self._slopes = np.abs(self.multipliers @ slopes[:, 1:-1])

    @property
    def left(self) -> float:
        """The largest of the functionals that should vanish, as a part of its terms."""
        return float(np.max(np.abs(self.moments[1:]) / self.sizes[1:]))

    def step(self, damping: float) -> Array:
        """Return a damped step of Newton's; the second derivative is 2Σ f fᵀ/|λ̇|."""
        scale = self.sizes[1:]
        half = self._weights / scale[:, None] * np.sqrt(2 / self._slopes)
        curved = half @ half.T
        curved += damping * np.trace(curved) * np.eye(len(scale))
        return np.asarray(-np.linalg.solve(curved, self.moments[1:] / scale) / scale)

    def _costate(self, t: Array) -> Array:
        return np.asarray(self.multipliers @ self.functionals.at(t)[0])

    def _slope(self, t: Array) -> Array:
        return np.asarray(self.multipliers @ self.functionals.at(t)[2])

    def _crossings(self) -> Array:
        """Return when λ changes its sign, also twice between two times of a grid."""
        fastest = max(mode.frequency for mode in self.functionals.modes)
        points = max(_LEAST, ceil(_A_PERIOD * self.end * fastest / (2 * pi)))
        t = np.linspace(0.0, self.end, points + 1)
        near = np.abs(self._costate(t)) < np.abs(self._slope(t)) * t[1]
        extremes = _zeros(self._slope, t, _NEAR, near[1:] | near[:-1])
        return _zeros(self._costate, np.union1d(t, extremes), _TO_THE_END)


def _zeros(
    function: Callable[[Array], Array], t: Array, bisections: int, among: Array | bool = True
) -> Array:
    """Return zeros between neighbouring times at which a function has unlike signs."""
    positive = function(t) > 0
    turned = np.flatnonzero((positive[1:] != positive[:-1]) & among)
    low, high, before = t[turned], t[turned + 1], positive[turned]
    for _ in range(bisections):
        middle = (low + high) / 2
        same = (function(middle) > 0) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return (low + high) / 2


def fastest(start: FullTorque, size: float) -> FullTorque:
    """Return the shortest full torque with −∫t u = size.

    Parameters
    ----------
    start : FullTorque
        Of about its multipliers and its time.
    size : float
        J·angle/limit in s².

    Raises
    ------
    AccuracyError
        If the functionals do not vanish to rounding.
    """
    found = _farthest(start)
    for _ in range(_TIMES):
        missing = size - found.reach
        if abs(missing) <= 4 * _ROUNDING * found.sizes[0] or not found.at_end:
            break
        # |λ| at the end is how the least ∫|λ| grows with its time.
        end = max(found.end + missing / abs(found.at_end), found.end / 2)
        found = _farthest(FullTorque(found.functionals, found.multipliers[1:], end))
    if not (found.left <= _ENOUGH and abs(missing) <= _ENOUGH * size):
        short = abs(missing) / size
        raise AccuracyError(
            "the multipliers of the fastest turn are not found: "
            + (
                f"{found.left:.1g} of the vibration is left"
                if found.left > _ENOUGH
                else f"it ends {short:.1g} of the turn away"
            ),
            where="rest_to_rest",
            remedy="leave out a mode, or turn by another angle",
        )
    return found


def _farthest(torque: FullTorque) -> FullTorque:
    """Return the full torque of the same time that reaches farthest, by damped Newton steps."""
    damping = _DAMPING[0]
    for _ in range(_STEPS):
        if torque.left <= _LEFT or not len(torque.switches) or damping > _DAMPING[1]:
            break
        p = torque.multipliers[1:] + torque.step(damping)
        tried = FullTorque(torque.functionals, p, torque.end)
        change = (tried.reach - torque.reach) / abs(torque.reach)
        if change < -_ROUNDING or (change < _ROUNDING and tried.left < torque.left):
            torque, damping = tried, max(damping / 30, _DAMPING[0])
        elif torque.left <= _FINE:  # no step is better than rounding
            break
        else:
            damping *= 10
    return torque
