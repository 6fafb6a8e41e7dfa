"""Roots of one function in many enclosures at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slewctl._types import Array, IntArray

# Bisection alone would take 53 for 16 digits; more end what does not converge.
_STEPS = 200
# Newton's method takes few, or has the enclosure halved; from this relative step on they end.
_NEWTON, _SMALL = 25, 1e-9
# Steps that have shrunk by this go on to shrink by squares.
_FASTER = 1e-2
# How near to a root signs are looked at.
_ULPS, _WIDER = 8 * float(np.finfo(float).eps), 64


def polished(
    function: Callable[[Array, IntArray], Array], left: Array, right: Array
) -> tuple[Array, Array]:
    """Return the root of `function` in each enclosure to the last digits, and how far it may be.

    Chandrupatla's method (Advances in Engineering Software 28, 1997): inverse quadratic
    interpolation where it is safe, else bisection.  All enclosures go together, since one
    evaluation of many points costs little more than one of a single point.

    Parameters
    ----------
    function : callable
        From points, and the numbers of the enclosures that they are in, to values.
    left, right : ndarray
        Ends of the enclosures, where the function differs in sign.  An end of which the
        sign does not survive a second evaluation is the root itself.

    Returns
    -------
    root, off : ndarray
        The function, as it is evaluated, changes sign no farther than `off` from the root: few
        doubles are roots, and beside a lightly damped pole the next one is far away.
    """
    left, right = np.array(left, dtype=float), np.array(right, dtype=float)
    if not len(left):
        return left, right
    every = np.arange(len(left))
    a, b = right.copy(), left.copy()
    fa, fb = function(a, every), function(b, every)
    root = np.where(np.abs(fb) < np.abs(fa), left, right)
    c, fc = a.copy(), fa.copy()
    t, off = np.full(len(a), 0.5), np.zeros(len(a))
    open_ = np.flatnonzero(np.sign(fa) * np.sign(fb) < 0)
    for _ in range(_STEPS):
        if not len(open_):
            break
        k = open_
        x = a[k] + t[k] * (b[k] - a[k])
        fx = function(x, k)
        same = np.sign(fx) == np.sign(fa[k])
        c[k], fc[k] = np.where(same, a[k], b[k]), np.where(same, fa[k], fb[k])
        b[k], fb[k] = np.where(same, b[k], a[k]), np.where(same, fb[k], fa[k])
        a[k], fa[k] = x, fx
        root[k] = np.where(np.abs(fa[k]) < np.abs(fb[k]), a[k], b[k])
        width = np.abs(b[k] - a[k])
        off[k] = np.where(fx == 0, 0.0, width)
        tolerance = 2 * np.finfo(float).eps * np.abs(root[k])
        done = (width <= 2 * tolerance) | (fx == 0)
        t[k] = np.clip(
            _step(a[k], b[k], c[k], fa[k], fb[k], fc[k]),
            np.minimum(tolerance / np.maximum(width, 1e-300), 0.5),
            1 - np.minimum(tolerance / np.maximum(width, 1e-300), 0.5),
        )
        open_ = k[~done]
    return root, off


def passed(function: Callable[[Array], Array], points: Array) -> Array:
    """Return where `function` changes its sign between increasing points, to the last digits."""
    below = np.signbit(function(points))
    k = np.flatnonzero(below[1:] != below[:-1])
    return polished(lambda x, _: function(x), points[k], points[k + 1])[0]


def _step(a: Array, b: Array, c: Array, fa: Array, fb: Array, fc: Array) -> Array:
    """Return the fraction of the way from a to b where the next point lies."""
    with np.errstate(all="ignore"):
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        safe = (1 - np.sqrt(np.maximum(1 - xi, 0)) < phi) & (phi < np.sqrt(np.maximum(xi, 0)))
        quadratic = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (
            fc - fb
        )
    return np.where(safe & np.isfinite(quadratic), quadratic, 0.5)


def _between(a: Array, b: Array, fa: Array, fb: Array) -> Array:
    """Return where a straight line from one end to the other is zero; the middle, if nowhere."""
    with np.errstate(all="ignore"):
        x = a + (b - a) * (fa / (fa - fb))
    return np.where((x > a) & (x < b), x, 0.5 * (a + b))


def polished_by_slopes(
    function: Callable[[Array, IntArray], tuple[Array, Array]], left: Array, right: Array
) -> tuple[Array, Array]:
    """Return what `polished` does, of a function with its slope, by Newton's method.

    Steps that leave an enclosure are halvings of it.  In the end the sign is looked at on both
    sides of each root; where it is the same, `polished` has the last word.

    Parameters
    ----------
    function : callable
        As for `polished`; returns values and slopes.
    left, right : ndarray
    """
    left, right = np.array(left, dtype=float), np.array(right, dtype=float)
    if not len(left):
        return left, right
    every = np.arange(len(left))
    a, b = left.copy(), right.copy()
    fa, fb = function(np.concatenate([a, b]), np.tile(every, 2))[0].reshape(2, -1)
    x, step = _between(a, b, fa, fb), b - a
    open_ = every
    for _ in range(_NEWTON):
        k = open_
        fx, slope = function(x[k], k)
        same = np.sign(fx) == np.sign(fa[k])
        a[k], b[k] = np.where(same, x[k], a[k]), np.where(same, b[k], x[k])
        with np.errstate(all="ignore"):
            new = x[k] - fx / slope
        inside = (new >= a[k]) & (new <= b[k])
        new = np.where(fx == 0, x[k], np.where(inside, new, 0.5 * (a[k] + b[k])))
        before, size = step[k], np.abs(new)
        step[k], x[k] = np.abs(new - x[k]), new
        # Newton's steps that grow smaller no longer are rounding; halvings tell nothing.
        hidden = inside & (step[k] <= _SMALL * size) & (2 * step[k] >= before)
        # The next one, where steps shrink by squares: too small to be made.
        after = step[k] * np.minimum(step[k] / before, 1.0) ** 2
        small = inside & (step[k] <= _FASTER * before) & (after <= _ULPS / 4 * size)
        step[k] = np.where(small, after, step[k])
        open_ = k[(step[k] > _ULPS / 4 * size) & ~hidden]
        if not len(open_):
            break
    # Beside a light pole rounding hides more.
    count, off = len(x), np.maximum(_ULPS * np.abs(x), 2 * step)
    offs = np.stack([off, _WIDER * off])
    low, high = np.maximum(x - offs, left), np.minimum(x + offs, right)
    points, which = np.concatenate([low, high]), np.tile(every, 4)
    signs = np.sign(function(points.ravel(), which)[0]).reshape(2, 2, count)
    passed = signs[0] * signs[1] <= 0
    off = np.where(passed[0], np.maximum(x - low, high - x)[0], np.maximum(x - low, high - x)[1])
    doubtful = ~passed.any(axis=0)
    doubtful[open_] = True
    if doubtful.any():
        k = np.flatnonzero(doubtful)
        x[k], off[k] = polished(lambda v, i: function(v, k[i])[0], left[k], right[k])
    return x, off
