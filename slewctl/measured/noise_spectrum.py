"""The spectrum of a log's noise, read from what a fit leaves."""

from __future__ import annotations

import numpy as np
from scipy.special import digamma, polygamma

from slewctl._types import Array, IntArray

# Bins on either side over which the noise is averaged: few where it may be steep.
_WIDEST, _NARROWEST = 40, 10
_FEW = 2
# Exponential variables that are left in such a sum, at least.
_LEAST_LEFT = 1e-3


def smooth(power: Array, free: Array | float = 1.0) -> Array:
    """Return a spectrum of noise from a periodogram of what is left.

    A few bins are averaged, and the logarithm of that over more of them: neither does a line or
    a steep slope spill over, nor do single bins without power count for much.

    Parameters
    ----------
    power : ndarray, shape (k,)
    free : ndarray, shape (k,)
        Which part of the noise's power is left at each bin, 0 to 1.
    """
    few = np.full(len(power), _FEW)
    width = _running(np.ones(len(power)), few, total=True)
    left = np.clip(_running(free + np.zeros(len(power)), few, total=True), _LEAST_LEFT, width)
    # The mean of the logarithm of a sum of so many exponential variables, and its variance.
    total = np.maximum(_running(power, few, total=True), np.finfo(float).tiny)
    log, worth = np.log(total) - digamma(left), 1 / polygamma(1, left)
    half = np.clip(np.arange(len(log), dtype=int) // 2, _NARROWEST, _WIDEST)
    return np.asarray(np.exp(_levelled(log, worth, half)))


def drawn(generator: np.random.Generator, weight: Array, bins: IntArray, count: int) -> Array:
    """Return noise in time, shape (count,), of a spectrum that is known at some bins.

    Parameters
    ----------
    generator : Generator
    weight : ndarray, shape (k,)
        One over its deviation at each bin, of a discrete Fourier transform over √count.
    bins : ndarray of int, shape (k,)
        Increasing; what is beyond the last has the deviation of that.
    count : int
    """
    size = np.zeros(count // 2 + 1)
    size[bins] = 1 / weight
    size[bins[-1] + 1 :] = 1 / weight[-1]
    parts = generator.standard_normal((2, len(size))) * size / np.sqrt(2)
    return np.asarray(np.fft.irfft(parts[0] + 1j * parts[1], count) * np.sqrt(count))


def _levelled(log: Array, worth: Array, half: IntArray) -> Array:
    """Return a weighted mean over so many bins on either side; at the ends, that of a line.

    Where bins are missing on one side the mean alone would be that of the other: of noise that
    falls with frequency far too little at the lowest bins, which tell friction and gain.  The
    line is in the logarithm of frequency, in which such noise falls evenly.
    """
    k = np.arange(len(log))
    place, whole = np.log(k + 1.0), _running(worth, half)
    middle, mean = _running(place * worth, half) / whole, _running(log * worth, half) / whole
    spread = _running(place**2 * worth, half) / whole - middle**2
    slope = (_running(place * log * worth, half) / whole - middle * mean) / spread
    slope[(k >= half) & (k + half < len(log))] = 0.0
    return np.asarray(mean + slope * (place - middle))


def _running(values: Array, half: IntArray, *, total: bool = False) -> Array:
    """Return the mean, or sum, over so many values on either side, of fewer at the ends."""
    reached = np.concatenate([[0.0], np.cumsum(values)])
    k = np.arange(len(values))
    low, high = np.maximum(k - half, 0), np.minimum(k + half + 1, len(values))
    return np.asarray((reached[high] - reached[low]) / (1 if total else high - low))
