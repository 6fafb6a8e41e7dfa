"""Tables 1–3 and eq. 49–50: what the paper prints beside what is computed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.arm.catalogue import paper_beam
from slewctl.basis import Basis, ClampedFree, Slewing
from slewctl.basis.characteristic import clamped_free_roots, slewing_roots
from slewctl.model import assemble, truth
from slewctl.paper import published

# Roots i for which the asymptote stands beside the root.
_ASYMPTOTIC_ROWS = range(6, 11)


@dataclass(frozen=True)
class PrintedValue:
    """A printed number beside the computed one.

    Attributes
    ----------
    printed, computed : float
    difference : float
        computed − printed.
    units : float
        |difference| in units of the last printed place; up to 0.5 is rounding.
    """

    printed: float
    computed: float
    difference: float
    units: float


@dataclass(frozen=True)
class AsymptoteRow:
    """Root i ≥ 6 of one family beside the formula of Table 1's last row.

    Attributes
    ----------
    index : int
    root : float
        βL, to machine precision.
    printed, corrected : float
        The formula as printed and as it must be.
    """

    index: int
    root: float
    printed: float
    corrected: float


@dataclass(frozen=True)
class RootTable:
    """Table 1: βL of the uniform beam, rows 1–5, and the formulas for i = 6 … 10."""

    clamped_free: tuple[PrintedValue, ...]
    slewing: tuple[PrintedValue, ...]
    clamped_free_asymptotes: tuple[AsymptoteRow, ...]
    slewing_asymptotes: tuple[AsymptoteRow, ...]


@dataclass(frozen=True, eq=False)
class FrequencyTable:
    """Table 2 or 3: one natural frequency in Hz against the number of functions.

    Attributes
    ----------
    number : int
        Of the table in the paper.
    mode : int
        Flexible mode, 1 or 2.
    n : tuple of int
        Numbers of functions, one a row.
    clamped_free, slewing : tuple of PrintedValue
        In Hz, one a row.
    converged_hz : float
        Frequency of the converged model.
    converged_error : float
        Its estimated relative error.
    clamped_free_errors, slewing_errors : ndarray, shape (rows,)
        Computed frequency relative to the converged one, minus 1.
    """

    number: int
    mode: int
    n: tuple[int, ...]
    clamped_free: tuple[PrintedValue, ...]
    slewing: tuple[PrintedValue, ...]
    converged_hz: float
    converged_error: float
    clamped_free_errors: Array
    slewing_errors: Array


@dataclass(frozen=True, eq=False)
class EigenvectorTable:
    """Eq. 49 or 50: the eigenvectors with UᵀMU = I, one column a mode.

    Attributes
    ----------
    equation : int
    basis : str
    frequencies_hz : ndarray, shape (5,)
        Of the flexible modes, columns 2–6.
    printed, computed, difference : ndarray, shape (6, 6)
        The computed columns carry the printed signs; difference = computed − printed.
    units : ndarray, shape (6, 6)
        |difference| in units of the last printed place.
    column_units : ndarray, shape (6,)
        The largest of each column.
    column_errors : ndarray, shape (6,)
        Largest |difference| of each column relative to its largest entry.
    """

    equation: int
    basis: str
    frequencies_hz: Array
    printed: Array
    computed: Array
    difference: Array
    units: Array
    column_units: Array
    column_errors: Array


@dataclass(frozen=True, eq=False)
class Tables:
    """All numbers that the paper prints, beside the computed ones."""

    roots: RootTable
    first_frequency: FrequencyTable
    second_frequency: FrequencyTable
    clamped_free_vectors: EigenvectorTable
    slewing_vectors: EigenvectorTable


def tables() -> Tables:
    """Return Tables 1–3 and eq. 49–50, printed beside computed."""
    return Tables(
        root_table(),
        frequency_table(2, 1, published.FIRST_CLAMPED_FREE, published.FIRST_SLEWING),
        frequency_table(3, 2, published.SECOND_CLAMPED_FREE, published.SECOND_SLEWING),
        eigenvector_table(
            49, ClampedFree(published.FUNCTIONS), published.EIGENVECTORS_CLAMPED_FREE
        ),
        eigenvector_table(50, Slewing(published.FUNCTIONS), published.EIGENVECTORS_SLEWING),
    )


def root_table() -> RootTable:
    """Return Table 1 with both families of roots βL (dimensionless)."""
    last = _ASYMPTOTIC_ROWS[-1]
    cantilever, slewing = clamped_free_roots(last).z, slewing_roots(last).z
    return RootTable(
        _compare_all(published.CLAMPED_FREE_ROOTS, cantilever, published.ROOT_DECIMALS),
        _compare_all(published.SLEWING_ROOTS, slewing, published.ROOT_DECIMALS),
        tuple(
            AsymptoteRow(
                i,
                float(cantilever[i - 1]),
                published.clamped_free_asymptote(i),
                (2 * i - 1) * math.pi / 2,
            )
            for i in _ASYMPTOTIC_ROWS
        ),
        tuple(
            AsymptoteRow(
                i,
                float(slewing[i - 1]),
                published.slewing_asymptote(i),
                (4 * i + 1) * math.pi / 4,
            )
            for i in _ASYMPTOTIC_ROWS
        ),
    )


def frequency_table(
    number: int, mode: int, clamped_free: Sequence[float], slewing: Sequence[float]
) -> FrequencyTable:
    """Return Table 2 or 3 of the paper's beam.

    Parameters
    ----------
    number : int
        Of the table in the paper.
    mode : int
        Flexible mode; its first row has as many functions.
    clamped_free, slewing : sequence of float
        The printed columns in Hz.
    """
    arm = paper_beam()
    n = tuple(range(mode, mode + len(clamped_free)))
    exact = truth(arm)
    converged = float(exact.frequencies_hz[mode - 1])
    computed = [
        np.array([assemble(arm, kind(k)).frequencies_hz[mode - 1] for k in n])
        for kind in (ClampedFree, Slewing)
    ]
    return FrequencyTable(
        number,
        mode,
        n,
        _compare_all(clamped_free, computed[0], published.FREQUENCY_DECIMALS),
        _compare_all(slewing, computed[1], published.FREQUENCY_DECIMALS),
        converged,
        float(exact.frequency_errors[mode - 1]),
        computed[0] / converged - 1,
        computed[1] / converged - 1,
    )


def eigenvector_table(
    equation: int, basis: Basis, printed: tuple[tuple[float, ...], ...]
) -> EigenvectorTable:
    """Return eq. 49 or 50 of the paper's beam.

    Parameters
    ----------
    equation : int
    basis : Basis
        Five functions.
    printed : tuple of tuple of float
        The printed matrix by rows.
    """
    model = assemble(paper_beam(), basis)
    reference = np.array(printed)
    place = 10.0**-published.EIGENVECTOR_DECIMALS
    computed = with_signs_of(reference, model.mode_shapes)
    units = np.abs(computed - reference) / place
    return EigenvectorTable(
        equation,
        basis.name,
        model.frequencies_hz,
        reference,
        computed,
        computed - reference,
        units,
        units.max(axis=0),
        np.abs(computed - reference).max(axis=0) / np.abs(computed).max(axis=0),
    )


def with_signs_of(reference: Array, columns: Array) -> Array:
    """Return `columns` with the sign of each chosen to match that of `reference`."""
    return columns * np.where(np.sum(reference * columns, axis=0) < 0, -1.0, 1.0)


def _compare_all(
    printed: Sequence[float], computed: Array, decimals: int
) -> tuple[PrintedValue, ...]:
    pairs = zip(printed, computed[: len(printed)], strict=True)
    return tuple(_compare(value, float(exact), decimals) for value, exact in pairs)


def _compare(printed: float, computed: float, decimals: int) -> PrintedValue:
    difference = computed - printed
    return PrintedValue(printed, computed, difference, abs(difference) * 10.0**decimals)
