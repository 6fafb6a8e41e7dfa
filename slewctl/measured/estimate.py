"""A frequency response from a log, by averaged spectra (Welch), with its confidence.

With an instrument r (the input itself; the output; or, in closed loop, the reference, which
knows nothing of the noise) the response is G = S_yr/S_ur.  The spectrum of what is left,
e = y − G u, gives the variance |ΔG|² = S_ee S_rr/(n |S_ur|²) for n independent averages, for
every instrument alike.  (J. S. Bendat and A. G. Piersol, Random Data, 4th ed., 2010, chapter 9;
P. E. Wellstead, Automatica 17 (1981) 55–69, for closed loops.)
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from slewctl._threads import single_threaded
from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError, check_choice, check_positive, shown
from slewctl.measured.log import Log
from slewctl.measured.response import Response
from slewctl.numerics.frequency_response import axis_points
from slewctl.plant.signals import signal

Method = Literal["H1", "H2", "reference"]
# Segments of which a record is made without further wishes.
_SEGMENTS = 8
# Of a Hann window: segments that overlap by half lose little (P. D. Welch, 1967).
_OVERLAP = 0.5
_FEWEST = 16  # samples in a segment


@single_threaded
def estimate_response(
    log: Log, *, segment_s: float | None = None, method: Method | None = None
) -> Response:
    """Return the frequency response that a log shows, with its coherence and deviation.

    Resonances narrower than the resolution, 1.5 over the segment's length, come out too low
    and too wide: `fit` does better on the log itself.

    Parameters
    ----------
    log : Log
    segment_s : float, optional
        Length of a segment in s: the resolution is its inverse.  An eighth of the record by
        default; longer ones resolve more and average less.
    method : {"H1", "H2", "reference"}, optional
        H1: noise is at the output; H2: at the input; reference: S_yr/S_ur, for a log in closed
        loop, where H1 and H2 are biased.  By default the reference where there is one, else H1.

    Returns
    -------
    Response
        Sampled, from the held input to the output: of an angle or a deflection it is estimated
        on the increments and divided by z − 1, since a hub that turns freely drifts.

    Raises
    ------
    InputError
        For a segment that the record does not hold twice, or a reference that was not logged.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.Beam(0.5, 0.3, 0.15), sc.Hub(0.003, friction=0.02), damping_ratio=0.01)
    >>> log = sc.simulated_log(arm, sc.prbs(4000, seed=1), 0.005, counts_per_turn=2048)
    >>> measured = sc.estimate_response(log)
    >>> round(float(measured.frequencies_hz[0]), 2), float(measured.coherence.max()) > 0.99
    (0.8, True)
    """
    if not isinstance(log, Log):
        raise InputError(f"{shown(log)} is no log", where="log", remedy="give a slewctl.Log")
    chosen = method or ("reference" if log.closed_loop else "H1")
    check_choice(chosen, ("H1", "H2", "reference"), "estimate_response.method")
    if chosen == "reference" and log.reference is None:
        raise InputError(
            "the log has no reference", where="estimate_response.method", remedy="use H1"
        )
    length = _length(log, segment_s)
    spectra = _Spectra(log, length, chosen)
    # Two bins at each end belong to the window, not to the frequency.
    kept = slice(2, len(spectra.frequencies_hz) - 2)
    frequencies, values = spectra.frequencies_hz[kept], spectra.values[kept]
    if spectra.increments:
        values = values / axis_points(2 * np.pi * frequencies, log.sample_time)
    return Response(
        frequencies,
        values,
        spectra.deviation[kept],
        spectra.coherence[kept],
        log.sample_time,
        log.actuator,
        log.sensor,
        log.source,
        (
            f"{chosen}, {spectra.averages:.3g} averages of {length * log.sample_time:.4g} s, "
            f"resolution {1.5 / (length * log.sample_time):.2g} Hz",
        ),
    )


def noise_power(log: Log, omega: Array) -> Array:
    """Return the spectrum of a log's noise at each ω in rad/s, without any model of the arm.

    It is that of y − G u with the response estimated, in the scale of |Σ e(k) z⁻ᵏ|²/N.  Where
    resonances are narrower than the resolution it is too large.
    """
    spectra = _Spectra(log, _length(log, None), "reference" if log.closed_loop else "H1")
    known = 2 * np.pi * spectra.frequencies_hz[2:-2]
    power = np.exp(np.interp(omega, known, np.log(spectra.left[2:-2])))
    return power / np.abs(axis_points(omega, log.sample_time)) ** 2 if spectra.increments else power


def _length(log: Log, segment_s: float | None) -> int:
    if log.samples < 4 * _FEWEST:
        raise InputError(
            "; ".join([f"{log.samples} samples make no spectrum", *log.remarks]),
            where="log",
            remedy=f"give at least {4 * _FEWEST}",
        )
    if segment_s is None:
        return max(2 * (log.samples // (2 * _SEGMENTS)), _FEWEST)
    length = round(check_positive(segment_s, "segment_s") / log.sample_time)
    if not _FEWEST <= length <= log.samples // 2:
        raise InputError(
            f"{segment_s:g} s are {length} samples of {log.samples}",
            where="segment_s",
            remedy=f"give {_FEWEST * log.sample_time:g} to {log.duration / 2:g} s",
        )
    return length


class _Spectra:
    """Averaged spectra of a log, and what follows from them."""

    def __init__(self, log: Log, length: int, method: str) -> None:
        from scipy.signal import get_window  # slow to load: not before it is wanted

        self.increments = signal(log.sensor).of == "displacement"
        window = get_window("hann", length)
        hop = max(int(length * (1 - _OVERLAP)), 1)
        u = log.input
        y = np.diff(log.output) if self.increments else log.output
        u = u[: len(y)]
        r = u if method == "H1" or log.reference is None else log.reference
        r = y if method == "H2" else r
        parts = [_segments(column[: len(y)], window, hop) for column in (u, y, r)]
        self.frequencies_hz: Array = np.arange(length // 2 + 1) / (length * log.sample_time)
        self._energy = float(window @ window)
        self.averages = _independent(window, hop, len(parts[0]))
        self._solve(*parts)

    def _solve(self, U: ComplexArray, Y: ComplexArray, R: ComplexArray) -> None:
        def cross(a: ComplexArray, b: ComplexArray) -> ComplexArray:
            return np.asarray(np.mean(a * b.conj(), axis=0))

        S_ur, S_rr = cross(U, R), cross(R, R).real
        with np.errstate(divide="ignore", invalid="ignore"):
            self.values = cross(Y, R) / S_ur
            left = Y - self.values * U
            # One response takes one average out of what is left.
            spare = max(1 - 1 / self.averages, np.finfo(float).eps)
            self.left: Array = cross(left, left).real / self._energy / spare
            variance = cross(left, left).real * S_rr / (self.averages * spare * np.abs(S_ur) ** 2)
            size = np.abs(self.values) ** 2
            self.deviation = np.sqrt(variance / (2 * size))
            self.coherence = size / (size + self.averages * spare * variance)


def _segments(column: Array, window: Array, hop: int) -> ComplexArray:
    """Return the spectra of overlapping segments, shape (segments, frequencies)."""
    pieces = np.lib.stride_tricks.sliding_window_view(column, len(window))[::hop]
    pieces = pieces - pieces.mean(axis=1, keepdims=True)
    return np.asarray(np.fft.rfft(pieces * window, axis=1))


def _independent(window: Array, hop: int, count: int) -> float:
    """Return how many independent averages overlapping segments are worth (Welch 1967)."""
    energy = float(window @ window)
    total = 1.0
    for shift in range(1, count):
        if shift * hop >= len(window):
            break
        overlap = float(window[shift * hop :] @ window[: -shift * hop]) / energy
        total += 2 * (1 - shift / count) * overlap**2
    return count / total
