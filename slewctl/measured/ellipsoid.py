"""The uncertainty of a fit as arms: the ends of the axes of its ellipsoid."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from slewctl._types import Array, BoolArray


def ellipsoid_ends(values: Array, covariance: Array, logarithmic: BoolArray, level: float) -> Array:
    """Return the ends of the principal axes of a confidence ellipsoid, shape (2p, p).

    The axes are those of the correlations, of the logarithms where a property is a factor, so
    that no unit turns them.

    Parameters
    ----------
    values : ndarray, shape (p,)
    covariance : ndarray, shape (p, p)
        Of the values.
    logarithmic : ndarray of bool, shape (p,)
        Whose logarithm is normally distributed; the others are cut at zero.
    level : float
        Probability of the ellipsoid.
    """
    deviation = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(deviation, deviation)
    sizes, axes = np.linalg.eigh(correlation)
    reach = np.sqrt(chdtri(len(values), 1 - level))
    ends = []
    for size, axis in sorted(zip(sizes, axes.T, strict=True), key=lambda pair: -pair[0]):
        step = reach * np.sqrt(max(size, 0.0)) * deviation * axis
        # Which end comes first must not hang on rounding: the first large part rises at the last.
        step = step * np.sign(step[np.argmax(np.abs(axis) > np.abs(axis).max() / 2)])
        for side in (-1.0, 1.0):
            with np.errstate(over="ignore", invalid="ignore"):
                grown = values * np.exp(side * step / values)
            moved = np.maximum(values + side * step, 0.0)
            ends.append(np.where(logarithmic, grown, moved))
    return np.array(ends)
