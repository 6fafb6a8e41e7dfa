"""Zeros, poles and a gain, or polynomials, as a state space of short sections in series."""

from __future__ import annotations

import warnings

import numpy as np

from slewctl._types import Array, ComplexArray
from slewctl.errors import InputError, shown
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem

# A root whose imaginary part is smaller, relative, is real.
_REAL = 1e-12


def cascade(zeros: ComplexArray, poles: ComplexArray, gain: float, dt: float = 0.0) -> LinearSystem:
    """Return gain·Π(s − z)/Π(s − p) as sections of at most second order in series.

    Roots never become one long polynomial, whose coefficients would lose them.

    Parameters
    ----------
    zeros, poles : ndarray of complex
        Conjugate pairs together; not more zeros than poles.
    gain : float
    dt : float
    """
    none = np.zeros((0, 0))
    whole = LinearSystem(none, none.reshape(0, 1), none.reshape(1, 0), gain, dt)
    above = _factors(zeros)
    # Longer factors first, so that a zero alone finds a pole, or two that are left over.
    for below in _factors(poles):
        fits = next((k for k, factor in enumerate(above) if len(factor) <= len(below)), None)
        whole = series(whole, polynomials(above.pop(fits) if fits is not None else np.ones(1),
                                          below, dt))  # fmt: skip
    return whole


def _factors(roots: ComplexArray) -> list[Array]:
    """Return real polynomials of second order, and one of first if their number is odd."""
    turning = np.abs(roots.imag) > _REAL * np.abs(roots)
    pairs = [np.array([1.0, -2 * r.real, abs(r) ** 2]) for r in roots[turning & (roots.imag > 0)]]
    single = np.sort(roots[~turning].real)
    pairs += [np.poly(single[k : k + 2]) for k in range(0, len(single), 2)]
    return pairs


def polynomials(num: Array, den: Array, dt: float = 0.0, where: str = "num") -> LinearSystem:
    """Return num(s)/den(s), coefficients with the highest power first, in controllable form.

    Raises
    ------
    InputError
        If it is improper, or the denominator is zero.
    """
    up, down = (np.trim_zeros(np.asarray(c, dtype=float), "f") for c in (num, den))
    if not len(down):
        raise InputError("it is zero", where="den", remedy="give a polynomial")
    if len(up) > len(down):
        raise InputError(
            f"more zeros ({len(up) - 1}) than poles ({len(down) - 1}): nothing can run it",
            where=where,
            remedy="add poles above the frequencies of interest",
        )
    n = len(down) - 1
    below = down[1:] / down[0]
    above = np.concatenate([np.zeros(n + 1 - len(up)), up]) / down[0]
    A = np.vstack([-below[None], np.eye(n)[:-1]]) if n else np.zeros((0, 0))
    B = np.eye(n, 1)
    return LinearSystem(A, B, (above[1:] - above[0] * below)[None], above[0], dt)


def read_coefficients(value: object, where: str) -> Array:
    """Return polynomial coefficients; refuse what are none."""
    return np.real(_numbers(value, where, real=True))


def read_roots(value: object, where: str) -> ComplexArray:
    """Return roots, complex ones as numbers or as pairs [re, im]; conjugates must be there."""
    roots = _numbers(value, where, real=False)
    paired = np.sort_complex(roots), np.sort_complex(roots.conj())
    if not np.allclose(*paired, rtol=_REAL, atol=0.0):
        raise InputError(
            "a complex root without its conjugate",
            where=where,
            remedy="give both, as in [[-1.0, 2.0], [-1.0, -2.0]]",
        )
    return roots


def _numbers(value: object, where: str, *, real: bool) -> ComplexArray:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = np.asarray(_joined(value, real), dtype=complex)
    except (TypeError, ValueError, Warning):
        found = np.zeros((0, 0), dtype=complex)
    if found.ndim > 1 and 1 in found.shape:  # MATLAB's row or column
        found = found.ravel()
    found = np.atleast_1d(found) if found.size else found.ravel() if found.ndim == 1 else found
    if found.ndim != 1 or not np.isfinite(found).all() or (real and np.iscomplex(found).any()):
        raise InputError(
            f"{shown(value)} is not a list of finite numbers",
            where=where,
            remedy="give one, as in [1.0, 0.5]",
        )
    return found


def _joined(value: object, real: bool) -> object:
    """Return a list in which pairs [re, im] are complex numbers."""
    if real or not isinstance(value, list | tuple):
        return value
    return [
        complex(*item) if isinstance(item, list | tuple) and len(item) == 2 else item
        for item in value
    ]
