"""Margins of several loops: one at a time, and all at once by the multiloop disk margin.

A loop that is broken at several channels returns u = −L u.  Each channel on its own, with
the others closed, has classical margins; they can be perfect where small simultaneous
changes destabilise.  The multiloop disk margin lets every channel's factor

    f = (1 + (1 − σ)/2 · δ) / (1 − (1 + σ)/2 · δ),   |δ| < α

vary on its own, each a dynamic system: α is 1/sup μ(S + (σ − 1)/2) with S = (I + L)⁻¹ and μ
for a diagonal of complex scalars (Seiler, Packard and Gahinet, An introduction to disk
margins, IEEE Control Systems Magazine 40(5), 2020).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from slewctl._threads import single_threaded
from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError, check_number
from slewctl.loop.parts import System, negated, state_space
from slewctl.loop.robust.mu_peak import StructuredPeak, structured_peak
from slewctl.loop.robust.return_ratios import for_negative_feedback, one_loop, sensitivity
from slewctl.loop.single.classical_margins import classical_margins
from slewctl.loop.single.disk import disk_gains, disk_phase_deg
from slewctl.loop.single.margin_results import Margins
from slewctl.loop.single.mode_names import Modes, modes_of_loop
from slewctl.loop.single.stability import UnstableLoopError
from slewctl.numerics.frequency_response import FrequencyResponse, axis_points, sample_time
from slewctl.numerics.interconnect import side_by_side
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import stability_threshold

if TYPE_CHECKING:
    import control

# The destabilised pole may lie this far from the axis, relative to its frequency.
AXIS_TOLERANCE = 1e-6
# Inside of the margin the closed loop is tried at this fraction of it.
_INSIDE = 1 - 1e-6
_TRIED = 12  # random changes of phase at that fraction
# A critical frequency this far below the slowest pole is zero but for rounding.
_AT_ZERO = 1e-9
# A factor of this size is infinite.
_INFINITE = 1e8


@dataclass(frozen=True, eq=False)
class MultiloopDisk:
    """The multiloop disk margin, enclosed.

    Attributes
    ----------
    guaranteed : float
        α that no simultaneous change within the disk destabilises, at any frequency.
    reached : float
        α at which the perturbation below destabilises; the margin lies between the two.
    frequency_hz : float or None
        Where; None for infinite frequency.
    perturbation : tuple of complex
        δ of each channel, all of size `reached`; empty where that is infinite.
    factors : tuple of complex
        f of each channel: what multiplies its loop there; one of them may be infinite.
    on_axis : float
        Distance of the closest closed-loop pole from jω (from e^{jωT} when sampled) with the
        factors applied, relative to ω (to ωT).
    skew : float
        σ.
    confirmed : bool
        Whether that distance is negligible, and no change tried inside of the guaranteed
        disk destabilised.
    mode : str
        The lightly damped pole of the open loop nearest to the frequency.
    """

    guaranteed: float
    reached: float
    frequency_hz: float | None
    perturbation: tuple[complex, ...]
    factors: tuple[complex, ...]
    on_axis: float
    skew: float
    confirmed: bool
    mode: str = ""

    @property
    def gap(self) -> float:
        """How far the two bounds lie apart, relative."""
        return self.reached / self.guaranteed - 1 if np.isfinite(self.reached) else 0.0

    @property
    def gains(self) -> tuple[float, float]:
        """Least and largest gain factor that all channels may have at once, in any combination."""
        return disk_gains(self.guaranteed, self.skew)

    @property
    def phase_deg(self) -> float:
        """Phase that all channels may turn by at once, in any combination of senses."""
        return disk_phase_deg(self.guaranteed, self.skew)


@dataclass(frozen=True, eq=False)
class MultiloopMargins:
    """Margins of a loop with several channels that is stable when closed.

    Attributes
    ----------
    channels : tuple of str
    one_at_a_time : tuple of Margins
        Of each channel with all others closed.
    disk : MultiloopDisk
    """

    channels: tuple[str, ...]
    one_at_a_time: tuple[Margins, ...]
    disk: MultiloopDisk


@single_threaded
def multiloop_margins(
    loop: System, skew: float = 0.0, *, sign: int | None = None
) -> MultiloopMargins:
    """Return the margins of a loop that is broken at several channels.

    Parameters
    ----------
    loop : control.StateSpace
        Return ratio L, square, continuous or sampled; see
        `slewctl.loop.robust.return_ratios`.  Channels with names of their own return each
        other: x, or ``returned_x``.
    skew : float
        σ: 0 for the balanced disk, 1 for changes that enter as 1/(1 − δ), −1 as 1 + δ.
    sign : {-1, 1}, optional
        Of the feedback, −1 unless told otherwise: the loop is closed as I + L.

    Returns
    -------
    MultiloopMargins

    Raises
    ------
    InputError
        If the loop is not square, not well posed, or its channels do not return each other.
    UnstableLoopError
        If the closed loop is unstable; where the opposite sign makes it stable the message
        says so.
    AccuracyError
        If the disk margin cannot be enclosed.

    Examples
    --------
    >>> import control
    >>> import slewctl as sc
    >>> G = control.ss([[-1.0, 0], [0, -2.0]], [[1.0, 0], [0, 1.0]], [[1.0, 1.0], [0, 1.0]], 0)
    >>> round(sc.multiloop_margins(G).disk.guaranteed, 3)
    2.0
    """
    loop = _checked(loop, sign)
    disk = multiloop_disk_margin(loop, skew)
    whole = modes_of_loop(loop)
    singles = tuple(
        classical_margins(one_loop(loop, channel), skew=skew, modes=_of_channel(whole, channel))
        for channel in range(loop.ninputs)
    )
    return MultiloopMargins(tuple(loop.input_labels), singles, disk)


def multiloop_disk_margin(
    loop: System, skew: float = 0.0, *, sign: int | None = None
) -> MultiloopDisk:
    """Return the multiloop disk margin alone (see `multiloop_margins`).

    Parameters
    ----------
    loop, skew, sign
        As for `multiloop_margins`.

    Returns
    -------
    MultiloopDisk

    Examples
    --------
    >>> import control
    >>> import slewctl as sc
    >>> G = control.ss([[-1.0, 0], [0, -2.0]], [[1.0, 0], [0, 1.0]], [[1.0, 1.0], [0, 1.0]], 0)
    >>> from slewctl.loop import multiloop_disk_margin
    >>> round(multiloop_disk_margin(G).guaranteed, 3)
    2.0
    """
    loop = _checked(loop, sign)
    sigma = check_number(skew, "skew")
    S = sensitivity(loop)
    _require_stable(loop, S)
    M = _shifted(S, (sigma - 1) / 2)
    peak = structured_peak(M)
    reached = 1 / peak.destabiliser.value if peak.destabiliser.value else np.inf
    delta = peak.destabiliser.delta if np.isfinite(reached) else np.zeros(0, complex)
    guaranteed = 1 / peak.upper if peak.upper else np.inf
    factors = _factors(delta, sigma)
    distance = _on_axis(loop, M, peak, factors) if np.isfinite(reached) else 0.0
    omega = 0.0 if peak.omega <= _AT_ZERO * _slowest(S) else peak.omega
    hertz = float(omega / (2 * np.pi)) if np.isfinite(omega) else None
    return MultiloopDisk(
        guaranteed,
        reached,
        hertz,
        tuple(complex(value) for value in delta),
        tuple(complex(value) for value in factors),
        distance,
        sigma,
        distance <= AXIS_TOLERANCE and _stable_inside(loop, guaranteed, sigma),
        _mode(loop, hertz),
    )


def _slowest(closed: LinearSystem) -> float:
    """Return the rate of the slowest pole in rad/s."""
    step = closed.sample_time
    poles = np.linalg.eigvals(closed.A)
    return float(np.abs((poles - 1) / step if step else poles).min(initial=np.inf))


def perturbation_system(disk: MultiloopDisk) -> control.StateSpace:
    """Return a real system whose frequency response at the critical frequency is `factors`.

    Each δ becomes ±α(s − β)/(s + β), an all-pass of its size: multiplying a continuous loop
    by the factors that follow puts a pair of poles at ±jω.

    Parameters
    ----------
    disk : MultiloopDisk
        Of a continuous loop, with a finite critical frequency greater than zero.

    Returns
    -------
    control.StateSpace

    Raises
    ------
    InputError
        Where there is no such frequency.

    Examples
    --------
    >>> import control
    >>> from slewctl.loop import multiloop_disk_margin, perturbation_system
    >>> A, C = [[-1.0, 4.0], [-4.0, -1.0]], [[0.0, 2.0], [-2.0, 0.0]]
    >>> L = control.ss(A, [[1.0, 0.0], [0.0, 1.0]], C, 0)
    >>> perturbation_system(multiloop_disk_margin(L)).ninputs
    2
    """
    if not disk.frequency_hz or not np.isfinite(disk.reached):
        raise InputError(
            "no real-rational perturbation belongs to this margin",
            where="perturbation_system",
            remedy="ask for one of a loop with a finite critical frequency greater than zero",
        )
    factors = [_all_pass_factor(delta, disk) for delta in disk.perturbation]
    return side_by_side(*factors).to_control()


def _all_pass_factor(delta: complex, disk: MultiloopDisk) -> LinearSystem:
    """Return f of a real all-pass δ(s) that equals `delta` at the critical frequency."""
    omega = 2 * np.pi * (disk.frequency_hz or 0.0)
    angle, size = float(np.angle(delta)), abs(delta)
    if angle <= 0:
        angle, size = angle + np.pi, -size
    beta = omega * np.tan(angle / 2)
    # f = 1 + δ/(1 − hδ) with δ = size (s − β)/(s + β) has one state.
    rest = 1 - (1 + disk.skew) / 2 * size
    pole = -beta * (2 - rest) / rest
    return LinearSystem(pole, 1.0, -2 * beta * size / rest**2, 1 + size / rest)


def _of_channel(modes: Modes, channel: int) -> Modes:
    """Return the same modes with what they contribute to one channel."""
    one = slice(channel, channel + 1)
    return Modes(modes.names, modes.rest, lambda omega: modes.parts(omega)[..., one, one])


def _mode(loop: LinearSystem, hertz: float | None) -> str:
    if hertz is None:
        return ""
    at = np.array([hertz])
    return modes_of_loop(loop).largest(at, FrequencyResponse(loop)(2 * np.pi * at))[0]


def _factors(delta: ComplexArray, sigma: float) -> ComplexArray:
    over, under = 1 + (1 - sigma) / 2 * delta, 1 - (1 + sigma) / 2 * delta
    # A quotient by zero would be no number in its imaginary part.
    return np.divide(over, under, out=np.full(delta.shape, np.inf + 0j), where=under != 0)


def _closed(loop: LinearSystem, factors: ComplexArray) -> ComplexArray:
    """Return the closed loop's A with each channel multiplied by its factor."""
    A, B, C, D = loop.matrices
    return np.asarray(A - (B * factors) @ np.linalg.solve(np.eye(len(D)) + D * factors, C))


def _on_axis(
    loop: LinearSystem, M: LinearSystem, peak: StructuredPeak, factors: ComplexArray
) -> float:
    """Return how far from the axis, at ω, the closest pole of the changed loop lies."""
    omega, delta, step = peak.omega, peak.destabiliser.delta, sample_time(loop)
    if not np.isfinite(omega) or not loop.nstates or not np.all(np.abs(factors) < _INFINITE):
        # No pole, but a loop that has no solution: I − MΔ is singular where there are no
        # dynamics, or the factor is infinite.
        at = np.asarray(M.D) + 0j
        if np.isfinite(omega) and loop.nstates:
            at = FrequencyResponse(M)(np.array([omega])).reshape(at.shape)
        values = np.linalg.svd(np.eye(len(at)) - at * delta, compute_uv=False)
        return float(values[-1] / max(values[0], 1.0))
    poles = np.linalg.eigvals(_closed(loop, factors))
    target = axis_points(np.array([omega]), step)[0] + (1.0 if step else 0.0)
    # At ω = 0 the slowest pole of the loop itself says what is near.
    nominal = np.linalg.eigvals(_closed(loop, np.ones(len(factors), dtype=complex)))
    slowest = np.abs(nominal - (1.0 if step else 0.0)).min()
    return float(
        np.abs(poles - target).min() / max(abs(axis_points(np.array([omega]), step)[0]), slowest)
    )


def _stable_inside(loop: LinearSystem, alpha: float, sigma: float) -> bool:
    """Whether the loop stays stable at corners and random points of the guaranteed disk."""
    n = loop.ninputs
    size = _INSIDE * alpha if np.isfinite(alpha) else 100.0
    turns = np.random.default_rng(0).uniform(-np.pi, np.pi, (_TRIED, n))
    corners = np.array(list(product((0.0, np.pi), repeat=min(n, 5))))
    corners = np.hstack([corners, np.zeros((len(corners), n - corners.shape[1]))])
    for turn in np.vstack([corners, turns]):
        factors = _factors(size * np.exp(1j * turn), sigma)
        if np.isfinite(factors).all() and not _is_stable(_closed(loop, factors), sample_time(loop)):
            return False
    return True


def _is_stable(A: ComplexArray | Array, step: float) -> bool:
    if not len(A):
        return True
    poles = np.linalg.eigvals(A)
    return bool(np.abs(poles).max() < 1 if step else poles.real.max() < 0)


def _grows(S: LinearSystem) -> complex | None:
    """Return the pole that grows fastest, or None where all are stable."""
    A, step = np.asarray(S.A), sample_time(S)
    if not len(A):
        return None
    poles = np.linalg.eigvals(A)
    growth = np.abs(poles) - 1 if step else poles.real
    if growth.max() < -stability_threshold(A):
        return None
    return complex(poles[np.argmax(growth)])


def _require_stable(loop: LinearSystem, S: LinearSystem) -> None:
    worst, step = _grows(S), sample_time(S)
    if worst is None:
        return
    rate = np.angle(worst) / step if step else abs(worst)
    what = f"the closed loop is unstable at {abs(rate) / (2 * np.pi):.4g} Hz and has no margins"
    remedy = "change the design; the loop's poles say where it fails"
    back = np.eye(loop.ninputs) - np.asarray(loop.D)
    if np.linalg.cond(back) < 1e12 and _grows(sensitivity(negated(loop))) is None:
        what += "; with the opposite sign of the feedback it is stable"
        remedy = "look at `sign`: it is -1, negative feedback, unless told otherwise"
    raise UnstableLoopError(what, where="multiloop_margins", remedy=remedy)


def _checked(given: object, sign: int | None) -> LinearSystem:
    """Return L for negative feedback; refuse what is no square system."""
    loop = state_space(given, "multiloop_margins")
    if loop.ninputs != loop.noutputs:
        raise InputError(
            f"a loop of {loop.noutputs} outputs and {loop.ninputs} inputs cannot be closed",
            where="multiloop_margins",
            remedy="give a square return ratio L",
        )
    return for_negative_feedback(loop, sign)


def _shifted(S: LinearSystem, shift: float) -> LinearSystem:
    A, B, C, D = S.matrices
    return LinearSystem(A, B, C, D + shift * np.eye(len(D)), S.dt)
