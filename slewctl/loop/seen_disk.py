"""The disk margin of a loop as it is seen at frequencies dense at every pole, with no proof."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.loop.closed_response import ClosedResponse
from slewctl.numerics.frequency_response import with_resonances
from slewctl.numerics.linear_system import LinearSystem

# Frequencies from a tenth of the slowest pole to ten times the fastest, before poles are added.
_POINTS = 160
# Where a resonance is looked at, in its half-widths from its middle: a peak between two of
# these is at most a quarter higher, and is found when it is looked at more closely.
_WIDTHS = np.array([0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0])
# Dips of up to so many times the deepest point are looked at more closely.
_NEAR = 1.5
# How often, and in how many parts: a parabola's lowest point is met to (1/5)⁶ of its rise.
_CLOSER, _PARTS = 3, 10
# What poles and residues may be off by at the deepest point.
_OFF = 1e-6


class Seen(Protocol):
    """What is looked at of a loop; `Loop` is one."""

    @property
    def poles(self) -> ComplexArray: ...
    @property
    def nyquist_rad_s(self) -> float: ...
    @property
    def linear(self) -> LinearSystem: ...
    @property
    def opened(self) -> LinearSystem: ...
    @property
    def exact_dead_time(self) -> float: ...
    def response(self, omega: Array) -> ComplexArray: ...


def seen_disk_margin(loop: Seen) -> float:
    """Return the disk margin α of a stable loop, the least 2|1 + L|/|1 − L| that is seen.

    Every dip of it belongs to a closed-loop pole: frequencies are dense there, and the deepest
    dips are looked at more closely.  Nothing is proved; `Loop.margins` proves, and takes ten
    times as long.

    Parameters
    ----------
    loop : Loop
        Stable, continuous or sampled.

    Returns
    -------
    float
        Not below the margin but for rounding; infinite for L = 1.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.loop.seen_disk import seen_disk_margin
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> loop = problem.judge(sc.lqg(problem.plant("clamped-free", n=1))).loop
    >>> abs(seen_disk_margin(loop) / loop.margins.disk.value - 1) < 1e-5
    True
    """
    omega = _frequencies(loop)
    if not (loop.exact_dead_time or loop.opened.D.any()):
        quick = ClosedResponse(loop)
        least, at = _lowest(quick, omega)
        if quick.off(at) <= _OFF:
            return least
    return _lowest(loop.response, omega)[0]


def _lowest(response: Callable[[Array], ComplexArray], omega: Array) -> tuple[float, float]:
    """Return the least α that is seen from some frequencies on, and where."""
    alpha = _alpha(response(omega))
    k = int(np.argmin(alpha))
    least, at = float(alpha[k]), float(omega[k])
    for _ in range(_CLOSER):
        dips = 1 + np.flatnonzero((alpha[1:-1] <= alpha[:-2]) & (alpha[1:-1] <= alpha[2:]))
        dips = dips[alpha[dips] <= _NEAR * least]
        if not len(dips):
            break
        omega = np.linspace(omega[dips - 1], omega[dips + 1], _PARTS + 1, axis=1)
        alpha = _alpha(response(omega.ravel()).reshape(omega.shape))
        omega, alpha = omega.ravel(), alpha.ravel()
        k = int(np.argmin(alpha))
        if alpha[k] < least:
            least, at = float(alpha[k]), float(omega[k])
    return least, at


def _alpha(values: ComplexArray) -> Array:
    """Return the radius of the disk that L reaches at each point; 2 at a pole of L."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found = 2 * np.abs(1 + values) / np.abs(1 - values)
    return np.asarray(np.where(np.isnan(found), 2.0, found))


def _frequencies(loop: Seen) -> Array:
    """Return frequencies in rad/s, increasing and dense at every closed-loop pole."""
    poles, last = loop.poles, loop.nyquist_rad_s
    size = np.abs(poles)[np.abs(poles) > 0]
    if not len(size):  # any frequency shows what a loop without poles is
        size = np.array([min(1.0, last)])
    fast = min(10 * float(size.max()), last)
    grid = np.geomspace(min(float(size.min()), fast) / 10, fast, _POINTS)
    ringing = poles[poles.imag > 0]
    return with_resonances(grid, _folded(ringing.imag, last), np.abs(ringing.real), _WIDTHS)


def _folded(omega: Array, last: float) -> Array:
    """Return where the samples show a frequency: between zero and half the sampling frequency."""
    if not np.isfinite(last):
        return omega
    return np.abs((omega + last) % (2 * last) - last)
