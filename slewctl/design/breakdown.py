"""The one place where what breaks down inside a design becomes one clear error."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from typing import ParamSpec, TypeVar

import numpy as np

from slewctl._threads import one_thread
from slewctl._types import Array
from slewctl.errors import AccuracyError, SlewctlError
from slewctl.plant import GeneralisedPlant

P = ParamSpec("P")
T = TypeVar("T")

# Decades from one beyond which a number is named as what probably broke the computation.
_ABSURD = 8.0


def check_finite(*matrices: Array) -> None:
    """Raise what `guarded` turns into a clear error where a number is not finite."""
    if not all(np.isfinite(matrix).all() for matrix in matrices):
        raise FloatingPointError("a number beyond what can be computed with")


def guarded(method: Callable[P, T]) -> Callable[P, T]:
    """Return a design method whose own errors are slewctl's, and that warns of nothing.

    What NumPy and SciPy warn of on the way is in the numbers, and the certificate judges
    those; what they raise becomes an `AccuracyError` that names the most extreme number
    given.  BLAS has one thread meanwhile.
    """

    @wraps(method)
    def inner(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            with one_thread(), np.errstate(all="ignore"), warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                return method(*args, **kwargs)
        except AccuracyError as error:
            key = _absurd(args, kwargs)
            if not key or error.where.startswith(key):
                raise
            raise error.within(key) from error
        except SlewctlError:
            raise
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            key = _absurd(args, kwargs)
            what = " ".join(str(error).split()) or type(error).__name__
            raise AccuracyError(
                f"the computation broke down ({what})",
                where=key or method.__name__,
                remedy="give a value nearer to one, or measure in other units"
                if key
                else "bring limits, noises and options closer together",
            ) from error

    return inner


def _absurd(args: tuple[object, ...], options: Mapping[str, object]) -> str:
    """Return the key of the most extreme number given, or nothing if none is extreme."""
    given = {**dict(_numbers(options)), **_weights(args, options)}
    extreme = max(given, key=lambda key: given[key], default="")
    return extreme if extreme and given[extreme] > _ABSURD else ""


def _weights(args: tuple[object, ...], options: Mapping[str, object]) -> dict[str, float]:
    """Return the objective's numbers by key, as decades from one."""
    objective = next(
        (a.objective for a in (*args, *options.values()) if isinstance(a, GeneralisedPlant)), None
    )
    if objective is None:
        return {}
    given = {f"limits.{key}": value for key, value in objective.limits.items()}
    given |= {f"noise.{key}": value for key, value in objective.noise.items()}
    return dict(_numbers(given))


def _numbers(table: Mapping[str, object]) -> Iterator[tuple[str, float]]:
    for key, value in table.items():
        if isinstance(value, (int, float)) and value:
            yield key, abs(math.log10(abs(value)))
