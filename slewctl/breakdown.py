"""What arithmetic raises on a plant that nobody thought of, as one error in the user's words."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from slewctl.errors import BreakdownError, SlewctlError

_BREAKDOWNS = (
    ArithmeticError,
    ValueError,
    LookupError,
    MemoryError,
    RecursionError,
    np.linalg.LinAlgError,
)


@contextmanager
def computing(place: str = "") -> Iterator[None]:
    """Run a computation so that whatever it raises names its place.

    Warnings of the numerical packages are not printed: results are checked, and a doubt is
    told with them.

    Parameters
    ----------
    place : str, optional
        What is computed, such as a design file.

    Raises
    ------
    SlewctlError
        As the computation raises it, with the place before its own unless that has it already.
    BreakdownError
        For an error of Python, numpy or LAPACK.
    """
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            yield
    except SlewctlError as error:
        if not place or error.where == place or error.where.startswith(f"{place}:"):
            raise
        raise error.within(place) from error
    except _BREAKDOWNS as broken:
        raise BreakdownError(
            f"the computation broke down ({type(broken).__name__}: {broken})",
            where=place,
            remedy="change a weight or a value",
        ) from broken
