"""A descent in the least squares of a log, at one spectrum of the noise."""

from __future__ import annotations

from functools import partial

from slewctl._types import Array
from slewctl.measured.record_data import RecordData, Remainder
from slewctl.measured.rig_parameters import Rig
from slewctl.measured.rig_problem import RigProblem

# Steps of one descent, and the relative fall of the squares that ends a coarse and a fine one.
_EACH, _COARSE, _FINE = 12, 1e-5, 1e-8


def record_slopes(
    problem: RigProblem,
    data: RecordData,
    remainder: Remainder,
    x: Array,
    *,
    two_sided: bool = False,
) -> Array:
    """Return the derivatives of what is left by the coordinates, shape (2k, n)."""
    of = partial(without_state, data, remainder)
    return problem.differences(of, x, None if two_sided else remainder.vector)


def without_state(data: RecordData, remainder: Remainder, rig: Rig) -> Array:
    """Return what is left at a rig, with a state that gained as much as at the one before.

    Its derivative is that of what is left with the state eliminated, but for a term of second
    order in the noise (L. Kaufman, BIT 15 (1975) 49–57).
    """
    return remainder.without(data.errors(rig, remainder.gained))


def descend_record(problem: RigProblem, data: RecordData, start: Array, *, fine: bool) -> Array:
    """Return where a descent ends; a fine one takes derivatives of second order.

    Those of first order are wrong by half a step times the curvature, which in a light mode
    that stands far above the noise moves the least squares by several deviations.
    """
    kept: dict[bytes, Remainder] = {}

    def part(x: Array) -> Remainder:
        key = x.tobytes()
        if key not in kept:
            kept.clear()
            kept[key] = data.state_part(problem.rig_at(x))
        return kept[key]

    def jacobian(x: Array) -> Array:
        return record_slopes(problem, data, part(x), x, two_sided=fine)

    return problem.descend(
        lambda x: part(x).vector,
        jacobian,
        start,
        robust=False,
        steps=_EACH,
        tolerance=_FINE if fine else _COARSE,
    )
