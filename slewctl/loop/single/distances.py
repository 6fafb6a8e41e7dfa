"""How far L is from −1 on intervals, and from the circles of disk margins.

With w = 1 + L and a shift k = (σ − 1)/2 the distance is |w|/|1 + k w|: k = 0 is |1 + L| itself,
the reciprocal of |S|; k = −1 is |1 + L|/|L|, that of |T|; k = −1/2 the balanced disk's.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array, BoolArray, ComplexArray
from slewctl.loop.single.enclosed import from_segment, product_curve, reach
from slewctl.loop.single.factored_loop import Enclosure
from slewctl.numerics.modal_bounds import ROUNDING

# Shifts by which the distance is the reciprocal of |S|, and of |T|.
OF_S, OF_T = 0.0, -1.0


def measured(shift: float, L: ComplexArray) -> Array:
    """Return the distances of values."""
    w = 1 + L
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.abs(w) / np.abs(1 + shift * w) if shift else np.abs(w))


def beyond(shift: float, box: Enclosure, t: float, order: int) -> BoolArray:
    """Return on which intervals the distance is at least t throughout.

    Parameters
    ----------
    shift : float
    box : Enclosure
    t : float
    order : int
        Of the loop's pole at the origin.
    """
    if shift == OF_S:
        return np.asarray(box.away >= t)
    if shift == OF_T:
        found = _far_in_t(box, t)
        left = ~found & (np.abs(box.value) > 1)
        if left.any():
            found[left] = _far_in_inverse(box, left, t, order)
        return found
    segment, point = (box.value, box.slope * box.h), (0 * box.value, 0 * box.value)
    return _outside(shift, segment, box.radius, t) | _outside(shift, point, box.most, t)


def where_large(shift: float, least: float) -> float:
    """Return the least distance where |L| is at least so large."""
    return (least - 1) / (1 + abs(shift) * (least - 1))


def near(shift: float, L: complex, away: float) -> float:
    """Return the least distance of what is no farther than `away` from a value."""
    w = 1 + L
    over = abs(1 + shift * w) + abs(shift) * away
    return max(abs(w) - away, 0.0) / over if over else np.inf


def _far_in_t(box: Enclosure, t: float) -> BoolArray:
    """Return where |1 + L|² ≥ t²|L|², as (1 − t²)|L|² + 2 Re L + 1 ≥ 0, without a quotient.

    T is one where L is large: then t is near to one, and its circle nearly a straight line.
    """
    A, L, step, R = 1 - t * t, box.value, box.slope * box.h, box.radius
    square, along = np.abs(step) ** 2, (A * L.conj() * step).real + step.real
    room = A * np.abs(L) ** 2 + 2 * L.real + 1
    if A > 0:
        back = np.clip(along / np.where(square > 0, A * square, 1.0), -1, 1)
        least = room - 2 * back * along + A * back * back * square
    else:
        least = room - 2 * np.abs(along) + A * square
    steep = np.maximum(np.abs(A * (L + step) + 1), np.abs(A * (L - step) + 1))
    terms = abs(A) * np.abs(L) ** 2 + 2 * np.abs(L) + 1
    inside = least - R * (2 * steep + max(-A, 0.0) * R) - ROUNDING * terms
    return np.asarray((inside >= 0) | (1 - box.most >= t * box.most))


def _far_in_inverse(box: Enclosure, here: BoolArray, t: float, k: int) -> BoolArray:
    """Return where |1 + 1/L| ≥ t, with 1/L = sᵏ/H, of some boxes on which L is large.

    However much L bends beside the pole at the origin, H does not.
    """
    c, h = box.c[here], box.h[here]
    H, H1, H2 = box.flat[here], box.flat_slope[here], box.flat_curve[here]
    error, (most, steep) = box.flat_error[here], reach(h, H, H1, H2)
    with np.errstate(all="ignore"):
        least = 2 * np.abs(H) - most - error
        of_H = 1 / H, -H1 / H**2, (2 * steep**2 / least + H2) / least**2
        far = c + h
        s = np.asarray(1j * c, dtype=complex)
        bend = np.asarray(k * (k - 1) * far ** max(k - 2, 0), dtype=float)
        of_s = s**k, 1j * k * s ** max(k - 1, 0), bend
        value, slope = of_s[0] * of_H[0], of_s[1] * of_H[0] + of_s[0] * of_H[1]
        R = 0.5 * h * h * product_curve(h, of_s, of_H) + far**k * (error / least**2)
        R += 4 * ROUNDING * np.abs(value)
        return np.asarray((least > 0) & (from_segment(value, slope, h, -1.0) - R >= t))


def _outside(
    shift: float, segment: tuple[ComplexArray, ComplexArray], R: Array, t: float
) -> BoolArray:
    """Whether |w| ≥ t|1 + shift·w|, w = 1 + L, within R of segments: of centre ± step."""
    middle, step = segment
    room = 1 - (t * shift) ** 2
    if abs(room) < 1e-12:  # the disk's outside is the half plane Re(shift·w) < −1/2
        far = np.sign(shift) * (middle.real + 1) + 1 / (2 * abs(shift))
        return np.asarray(far <= -(np.abs(step.real) + R))
    centre, radius = -1 + t * t * shift / room, t / abs(room)
    if room > 0:
        return np.asarray(from_segment(middle, step, np.ones_like(R), centre) - R >= radius)
    away = middle - centre
    return np.asarray(np.maximum(np.abs(away + step), np.abs(away - step)) + R <= radius)
