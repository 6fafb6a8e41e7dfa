"""Which of two sets belong together, each with one of the other, at the least cost in all."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, IntArray


def paired(cost: Array) -> tuple[IntArray, IntArray]:
    """Return rows and columns of a matrix whose entries have the smallest sum, one of each.

    Where the cheapest of each are all different, they are the answer; only where two want
    the same one an assignment problem is solved.

    Parameters
    ----------
    cost : ndarray, shape (m, n)

    Returns
    -------
    rows, columns : ndarray of int, shape (min(m, n),)
        The rows increase.
    """
    if len(cost) > cost.shape[1]:
        columns, rows = paired(cost.T)
        order = np.argsort(rows)
        return rows[order], columns[order]
    if not len(cost):
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    nearest = np.argmin(cost, axis=1)
    if len(np.unique(nearest)) == len(nearest) and np.isfinite(cost).all():
        return np.arange(len(cost)), nearest
    from scipy.optimize import linear_sum_assignment  # slow to load: not before it is wanted

    rows, columns = linear_sum_assignment(cost)
    return np.asarray(rows), np.asarray(columns)
