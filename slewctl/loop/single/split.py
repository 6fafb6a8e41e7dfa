"""A return ratio that is a product, taken apart where its matrices show it."""

from __future__ import annotations

import numpy as np

from slewctl._types import BoolArray
from slewctl.numerics.linear_system import LinearSystem


def in_series(loop: LinearSystem) -> tuple[LinearSystem, LinearSystem] | None:
    """Return the first and the second of two systems in series, in exactly these entries.

    The first holds the states that the input reaches only by way of each other; what the
    others are fed by them, and what is seen of them directly, are its outputs.

    Parameters
    ----------
    loop : LinearSystem
        One input and one output.

    Returns
    -------
    tuple of LinearSystem, or None
        None where the input reaches all states, or everything drives everything.
    """
    A, B, C, D = loop.matrices
    first = _driving(A != 0, B[:, 0] != 0)
    second = ~first
    if not first.any() or not second.any():
        return None
    inside = A[np.ix_(first, first)], A[np.ix_(second, second)]
    between = A[np.ix_(second, first)]
    rows, columns = between.any(axis=1), between.any(axis=0)
    if rows.sum() <= columns.sum():
        out, into = between[rows], np.eye(len(inside[1]))[:, rows]
    else:
        out, into = np.eye(len(inside[0]))[columns], between[:, columns]
    count = len(out)
    return (
        LinearSystem(
            inside[0],
            B[first],
            np.vstack([out, C[:, first]]),
            np.vstack([np.zeros((count, 1)), D]),
            loop.dt,
        ),
        LinearSystem(
            inside[1],
            np.hstack([into, np.zeros((len(into), 1))]),
            C[:, second],
            np.hstack([np.zeros((1, count)), np.eye(1)]),
            loop.dt,
        ),
    )


def _driving(coupled: BoolArray, driven: BoolArray) -> BoolArray:
    """Return the states that are driven, and all that drive them."""
    while True:
        more = driven | coupled[driven].any(axis=0)
        if (more == driven).all():
            return driven
        driven = more
