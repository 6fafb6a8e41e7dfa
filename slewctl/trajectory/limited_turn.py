"""The fastest turn of a flexible arm on a clock: limits of torque, voltage and their rates.

J θ̈ + c θ̇ = u, and η̈ + 2ζω η̇ + ω² η = δu for each mode, from rest to rest with the torque held
over each sample.  What is linear in the samples, ends and limits alike, makes a linear program;
the smallest number of samples that has a solution is found by bisection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, sqrt

import numpy as np
from scipy.linalg import expm

from slewctl._types import Array
from slewctl.errors import (
    AccuracyError,
    InputError,
    check_nonnegative,
    check_number,
    check_positive,
    check_types,
)
from slewctl.trajectory.fewest import fewest
from slewctl.trajectory.shapers import Mode, check_order

# What may be left at the end, of the turn's own size.
_LEFT = 1e-6
# Samples that a program may have, and the doublings of its first guess.
_MOST, _DOUBLINGS = 2000, 8


@dataclass(frozen=True)
class Drive:
    """What a drive can give.

    Parameters
    ----------
    torque : float, optional
        Largest torque in N·m.
    torque_rate : float, optional
        Largest change of it in a second, in N·m/s; from zero, and back to it.
    voltage : float, optional
        Largest voltage of a motor, in V.
    torque_per_volt, volts_per_rate : float
        Of that motor, N·m/V at rest and V·s/rad, as `Motor` has them.

    Raises
    ------
    InputError
        For no limit of torque or voltage, or a voltage without its motor, or the reverse.

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Drive(torque=2.0, torque_rate=40.0).voltage is None
    True
    """

    torque: float | None = None
    torque_rate: float | None = None
    voltage: float | None = None
    torque_per_volt: float = 0.0
    volts_per_rate: float = 0.0

    def __post_init__(self) -> None:
        for name in ("torque", "torque_rate", "voltage"):
            if getattr(self, name) is not None:
                check_positive(getattr(self, name), f"drive.{name}")
        for name in ("torque_per_volt", "volts_per_rate"):
            if check_nonnegative(getattr(self, name), f"drive.{name}") and self.voltage is None:
                raise InputError(
                    "is a motor's, and its voltage has no limit",
                    where=f"drive.{name}",
                    remedy="give the largest voltage too",
                )
        if self.torque is None and self.voltage is None:
            raise InputError(
                "no limit", where="drive", remedy="give the largest torque, or the voltage"
            )
        if self.voltage is not None:
            check_positive(self.torque_per_volt, "drive.torque_per_volt")


@dataclass(frozen=True, eq=False)
class HeldTurn:
    """A torque held over each sample, from rest to rest.

    Attributes
    ----------
    sample_time : float
        In s.
    torques : ndarray, shape (N,)
        In N·m.
    residual : float
        What is left of the end, recomputed: largest state beside the angle wanted, as a part
        of it (rates times the duration).
    """

    sample_time: float
    torques: Array
    residual: float

    @property
    def duration(self) -> float:
        """In s."""
        return self.sample_time * len(self.torques)

    def torque(self, t: Array) -> Array:
        """Return the torque in N·m at times t; at a change, that after it."""
        k = np.floor(np.asarray(t, dtype=float) / self.sample_time + 1e-9).astype(int)
        moving = (k >= 0) & (k < len(self.torques))
        return np.where(moving, self.torques[np.clip(k, 0, len(self.torques) - 1)], 0.0)


def limited_turn(
    angle: float,
    drive: Drive,
    inertia: float,
    modes: Sequence[Mode],
    sample_time: float,
    *,
    friction: float = 0.0,
    order: int = 1,
) -> HeldTurn:
    """Return the fastest turn on a clock, within limits, that leaves no vibration.

    Parameters
    ----------
    angle : float
        Angle turned in rad, not zero.
    drive : Drive
    inertia : float
        Of the whole arm about its axis, in kg·m².
    modes : sequence of Mode
        The arm's free modes; the voltage's limit is met with the rate of the rigid arm.
    sample_time : float
        Over which the torque is held, in s.
    friction : float
        Viscous friction at the hub in N·m·s.
    order : {1, 2}
        With 2 the residual's derivative with respect to each frequency vanishes as well.

    Returns
    -------
    HeldTurn

    Raises
    ------
    InputError
        For no turn, impossible numbers, or a clock that is too slow for a mode.
    AccuracyError
        If no turn of a reasonable number of samples is found, or its end, computed anew, is
        not at rest.

    Examples
    --------
    >>> import slewctl as sc
    >>> turn = sc.limited_turn(1.0, sc.Drive(torque=1.0), 2.0, [sc.Mode(2**0.5)], 0.02)
    >>> 4.2178 <= turn.duration <= 4.26
    True
    """
    if check_number(angle, "angle") == 0:
        raise InputError("no turn", where="angle", remedy="give an angle")
    check_order(order)
    (drive,) = check_types([drive], Drive, "drive")
    if not isinstance(modes, Sequence) or len(modes):  # of a rigid arm there are none
        modes = check_types(modes, Mode, "modes")
    T = check_positive(sample_time, "sample_time")
    check_positive(inertia, "inertia")
    check_nonnegative(friction, "friction")
    slowest = min((mode.half_period for mode in modes), default=inf) / 2
    if slowest < T:
        raise InputError(
            f"{T:g} s is too slow for a mode of {2 * slowest:.4g} s half a period",
            where="sample_time",
            remedy=f"take at most {0.999 * slowest:.4g} s",
        )
    program = _Program(abs(angle), drive, inertia, modes, T, friction, order)
    found = program.shortest()
    left = _left(found, abs(angle), inertia, modes, T, friction)
    if left > _LEFT:
        raise AccuracyError(f"the turn leaves {left:.2g} at its end", where="limited_turn")
    return HeldTurn(T, float(np.sign(angle)) * found, left)


@dataclass(frozen=True)
class _Program:
    angle: float
    drive: Drive
    inertia: float
    modes: Sequence[Mode]
    T: float
    friction: float
    order: int

    def shortest(self) -> Array:
        """Return the torques of the fewest samples."""
        first = self._guess()
        found = fewest(self._solved, first, _DOUBLINGS, none=1, most=_MOST)
        if found is None:
            tried = min(first * 2**_DOUBLINGS, _MOST)
            raise AccuracyError(
                f"no turn within {tried * self.T:.4g} s was found",
                where="limited_turn",
                remedy="allow more torque or voltage, or take a longer sample_time",
            )
        return found

    def _guess(self) -> int:
        """Return how many samples the rigid arm, and the modes, want."""
        drive = self.drive
        torque = drive.torque if drive.torque is not None else inf
        if drive.voltage is not None:
            torque = min(torque, drive.voltage * drive.torque_per_volt)
        rest = self.order * sum(mode.half_period for mode in self.modes)
        rigid = 2 * sqrt(self.angle * self.inertia / torque)
        if drive.torque_rate is not None:
            rigid += 2 * torque / drive.torque_rate
        return min(ceil((rigid + rest) / self.T) + 2, _MOST)

    def _solved(self, samples: int) -> Array | None:
        """Return torques of so many samples as parts of what they need, if there are."""
        from scipy.optimize import linprog  # slow to load: not before it is wanted

        # From the end of each sample to that of the last.
        back = np.asarray(self.T * np.arange(samples - 1, -1, -1.0))
        unit = self.inertia * self.angle / (samples * self.T) ** 2
        rate, turned = _rigid(back, self.T, self.inertia, self.friction)
        size = samples * self.T
        # By a torque of one unit the rigid arm turns by about the angle: the rows are near one.
        rows, ends = [turned / self.angle * unit, rate / self.angle * unit * size], [1.0, 0.0]
        for mode in self.modes:
            pole = mode.ratio * mode.frequency + 1j * mode.damped
            wave = np.exp(-pole * back)
            for power in range(self.order):
                row = (back / size) ** power * wave if power else wave
                if power:  # the mean over each sample of (t/size) e^(−pt), up to a multiple
                    row = _weighted(back, self.T, pole) / size
                rows += [row.real, row.imag]
                ends += [0.0, 0.0]
        limits, most = self._limits(samples, unit)
        found = linprog(
            np.zeros(samples), A_ub=limits, b_ub=most, A_eq=np.array(rows), b_eq=np.array(ends),
            bounds=self._bounds(unit), method="highs",
            options={"primal_feasibility_tolerance": 1e-9},
        )  # fmt: skip
        ok = found.x is not None and found.status == 0
        return unit * np.asarray(found.x, dtype=float) if ok else None

    def _bounds(self, unit: float) -> tuple[float | None, float | None]:
        if self.drive.torque is None:
            return None, None
        return -self.drive.torque / unit, self.drive.torque / unit

    def _limits(self, samples: int, unit: float) -> tuple[Array | None, Array | None]:
        """Return rows of what the rate and the voltage allow."""
        drive, rows, most = self.drive, [], []
        if drive.torque_rate is not None:
            steps = np.diff(np.eye(samples), axis=0, prepend=0.0, append=0.0)
            rows.append(steps)
            most.append(np.full(len(steps), drive.torque_rate * self.T / unit))
        if drive.voltage is not None:
            k = np.arange(samples)
            for end in (0, 1):  # of each sample: the rate changes while the torque is held
                since = self.T * (k[:, None] - 1 + end - k[None, :])
                since = np.maximum(since, 0.0).astype(float)
                gone = k[:, None] + end > k[None, :]
                rate = np.where(gone, _rigid(since, self.T, self.inertia, self.friction)[0], 0.0)
                volts = np.eye(samples) / drive.torque_per_volt + drive.volts_per_rate * rate
                rows.append(volts * drive.torque_per_volt)
                limit = drive.voltage * drive.torque_per_volt / unit
                most.append(np.full(samples, limit))
        if not rows:
            return None, None
        whole, right = np.vstack(rows), np.concatenate(most)
        return np.vstack([whole, -whole]), np.concatenate([right, right])


def _rigid(since: Array, T: float, inertia: float, friction: float) -> tuple[Array, Array]:
    """Return rate and angle so long after unit torque was held over one sample."""
    if not friction:
        return np.full(since.shape, T / inertia), T / inertia * (since + T / 2)
    c = friction / inertia
    lost = -np.expm1(-c * T) / c  # ∫ e^(−cs) over the sample
    coasting = -np.expm1(-c * since) / c
    rate = np.exp(-c * since) * lost / inertia
    angle = (T - lost) / c / inertia + lost / inertia * coasting
    return rate, angle


def _weighted(back: Array, T: float, pole: complex) -> Array:
    """Return ∫ (back + s) e^(−p(back + s)) ds over a sample, per its integral of e^(−ps)."""
    one = (1 - np.exp(-pole * T)) / pole
    two = (one - T * np.exp(-pole * T)) / pole
    return np.asarray(np.exp(-pole * back) * (back * one + two) / one)


def _left(
    torques: Array, angle: float, inertia: float, modes: Sequence[Mode], T: float, friction: float
) -> float:
    """Return what the end lacks, by the equations of motion from sample to sample."""
    blocks = [np.array([[0.0, 1.0], [0.0, -friction / inertia]])]
    blocks += [
        np.array([[0.0, m.frequency], [-m.frequency, -2 * m.ratio * m.frequency]]) for m in modes
    ]
    gains = [np.array([0.0, 1 / inertia])]
    gains += [np.array([0.0, 1 / (inertia * mode.frequency)]) for mode in modes]
    duration, worst = T * len(torques), 0.0
    for place, (A, b) in enumerate(zip(blocks, gains, strict=True)):
        whole = expm(T * np.block([[A, b[:, None]], [np.zeros((1, 3))]]))
        state = np.zeros(2)
        for torque in torques:
            state = whole[:2, :2] @ state + whole[:2, 2] * torque
        wanted = np.array([angle if place == 0 else 0.0, 0.0])
        scale = np.array([1.0, duration]) if place == 0 else np.ones(2)
        worst = max(worst, float(np.abs((state - wanted) * scale).max()) / angle)
    return worst
