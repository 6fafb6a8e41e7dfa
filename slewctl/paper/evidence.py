"""What an erratum rests on: a reference, and how far both forms are from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array


@dataclass(frozen=True)
class Evidence:
    """A computed comparison of the printed and the corrected form.

    Attributes
    ----------
    what : str
        One sentence: what is computed, and where.
    unit : str
    reference, printed, corrected : float
        The quantity found independently, and by both forms, at the point where the
        printed form is worst.
    printed_error, corrected_error : float
        Largest |form − reference| over all points.
    """

    what: str
    unit: str
    reference: float
    printed: float
    corrected: float
    printed_error: float
    corrected_error: float


Numbers = float | Sequence[float] | Array


def weigh(
    what: str, unit: str, *, reference: Numbers, printed: Numbers, corrected: Numbers
) -> Evidence:
    """Return the `Evidence` from values at one or many points (scalars broadcast).

    Parameters
    ----------
    what, unit : str
    reference, printed, corrected : float or ndarray, shape (points,)
    """
    exact, wrong, right = (
        np.ravel(values)
        for values in np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(v, dtype=float)) for v in (reference, printed, corrected))
        )
    )
    wrong_error, right_error = np.abs(wrong - exact), np.abs(right - exact)
    worst = int(np.argmax(wrong_error))
    return Evidence(
        what,
        unit,
        float(exact[worst]),
        float(wrong[worst]),
        float(right[worst]),
        float(wrong_error[worst]),
        float(right_error.max()),
    )
