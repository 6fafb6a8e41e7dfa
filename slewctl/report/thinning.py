"""Lines with fewer points, which look the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slewctl._types import Array, IntArray


def thinned(lines: Sequence[Array], allowed: float) -> list[Array]:
    """Return lines without the points that move them by no more than is allowed.

    The way of Ramer, Douglas and Peucker: a piece whose points are all close to its chord is
    that chord, another is cut at the point farthest from it.  The pieces of all lines are
    looked at together, and those that they are cut into in the next round.

    Parameters
    ----------
    lines : sequence of ndarray, shape (m, 2)
        Each of one point or more.
    allowed : float
        How far a point that is left out may be from the line that remains, at most.

    Returns
    -------
    list of ndarray, shape (≤ m, 2)
        The first and the last point of each line among them.

    Examples
    --------
    >>> import numpy as np
    >>> from slewctl.report.thinning import thinned
    >>> line = np.array([[0.0, 0.0], [1.0, 0.1], [2.0, 0.0], [3.0, 5.0]])
    >>> thinned([line], 0.2)[0].tolist()
    [[0.0, 0.0], [2.0, 0.0], [3.0, 5.0]]
    """
    if not lines:
        return []
    ends = np.cumsum([len(line) for line in lines])
    points = np.concatenate(lines)
    columns = np.ascontiguousarray(points.T)
    first, last = np.append(0, ends[:-1]), ends - 1
    keep = np.zeros(len(points), dtype=bool)
    keep[first] = keep[last] = True
    while (longer := last - first > 1).any():
        first, last = first[longer], last[longer]
        cut, middle = _farthest(columns, first, last, allowed)
        keep[middle] = True
        first, last = np.append(first[cut], middle), np.append(middle, last[cut])
    each = zip(np.split(points, ends[:-1]), np.split(keep, ends[:-1]), strict=True)
    return [line[kept] for line, kept in each]


def _farthest(
    points: Array, first: IntArray, last: IntArray, allowed: float
) -> tuple[IntArray, IntArray]:
    """Return which pieces have points too far from their chords, and each one's farthest."""
    size = last - first - 1
    start = np.cumsum(size) - size
    inner = np.arange(size.sum()) + np.repeat(first + 1 - start, size)
    x, y = points
    across, up = x[inner] - np.repeat(x[first], size), y[inner] - np.repeat(y[first], size)
    chord_x, chord_y = x[last] - x[first], y[last] - y[first]
    square = chord_x**2 + chord_y**2
    square[square == 0] = 1  # of a piece that ends where it begins
    along = across * np.repeat(chord_x / square, size) + up * np.repeat(chord_y / square, size)
    along = np.minimum(np.maximum(along, 0.0), 1.0)
    far = (across - along * np.repeat(chord_x, size)) ** 2
    far += (up - along * np.repeat(chord_y, size)) ** 2
    most = np.maximum.reduceat(far, start)
    cut = np.flatnonzero(most > allowed**2)
    reached = np.flatnonzero(far == np.repeat(most, size))
    return cut, inner[reached[np.searchsorted(reached, start[cut])]]
