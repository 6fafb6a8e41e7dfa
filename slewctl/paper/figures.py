"""The data of Figures 2–7, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.arm.catalogue import paper_beam
from slewctl.basis import Basis, ClampedFree, Slewing
from slewctl.model import Model, Truth, assemble, truth
from slewctl.paper import published
from slewctl.paper.simulation import TipRun, exact_map, run, taylor_map
from slewctl.paper.tables import with_signs_of

# Of a drawn curve.
_POINTS = 201
# The torque ends at 4 s; four more show the free vibration.
_HORIZON = 8.0

READING = (
    "Figures 4 and 5 are read as the fourth and fifth flexible modes, columns 5 and 6 of "
    "eq. 49-50. The other reading, columns 4 and 5 with the rigid rotation counted, would "
    "show the third and fourth flexible modes, which both bases give almost alike; only the "
    "fifth flexible mode is visibly wrong in the clamped-free functions, and that the higher "
    "modes suffer is what the paper says these figures show."
)


@dataclass(frozen=True, eq=False)
class ShapeFigure:
    """Figure 2 or 3: the first five admissible functions, in the paper's normalisation.

    Attributes
    ----------
    number : int
    basis : str
    x : ndarray, shape (points,)
        m.
    shapes : ndarray, shape (points, 5)
        One column a function.
    """

    number: int
    basis: str
    x: Array
    shapes: Array


@dataclass(frozen=True, eq=False)
class ModeFigure:
    """Figure 4 or 5: a mode shape by both bases and the converged one.

    Attributes
    ----------
    number : int
    mode : int
        Flexible mode, counted from 1.
    x : ndarray, shape (points,)
        m.
    clamped_free, slewing, truth : ndarray, shape (points,)
        Arc displacement (r + x)θ + v(x) with unit modal mass, m/(kg·m²)^½, signs alike.
    """

    number: int
    mode: int
    x: Array
    clamped_free: Array
    slewing: Array
    truth: Array


@dataclass(frozen=True)
class ModeDeviation:
    """How far both five-function models are from the converged mode.

    Attributes
    ----------
    mode : int
        Flexible mode, counted from 1.
    column : int
        Its column in eq. 49–50, the rigid rotation being column 1.
    clamped_free_shape, slewing_shape : float
        max |y − y_truth| / max |y_truth| along the beam.
    clamped_free_frequency, slewing_frequency : float
        Relative frequency error.
    """

    mode: int
    column: int
    clamped_free_shape: float
    slewing_shape: float
    clamped_free_frequency: float
    slewing_frequency: float


@dataclass(frozen=True, eq=False)
class TipFigure:
    """Figure 6 or 7: the tip under the bang-bang torque, from a five-function model.

    Attributes
    ----------
    number : int
    basis : str
    exact, taylor : TipRun
        Sampled exactly with a zero-order hold, and stepped with a Taylor series of order 4
        (Runge–Kutta 4); m.
    truth : TipRun
        The converged model, sampled exactly.
    exact_deviation_m : float
        Largest |exact − truth|.
    taylor_deviation_m : float or None
        Largest |taylor − truth|; None if the run leaves the range.
    """

    number: int
    basis: str
    exact: TipRun
    taylor: TipRun
    truth: TipRun
    exact_deviation_m: float
    taylor_deviation_m: float | None


@dataclass(frozen=True, eq=False)
class Figures:
    """The data of Figures 2–7.

    Attributes
    ----------
    functions : tuple of ShapeFigure
        Figures 2 and 3.
    modes : tuple of ModeFigure
        Figures 4 and 5.
    reading : str
        Which modes they are taken to show, and why.
    deviations : tuple of ModeDeviation
        All five flexible modes, on which that reading rests.
    tip : tuple of TipFigure
        Figures 6 and 7.
    truth_modes : int
        Flexible modes of the converged model in Figures 6 and 7.
    """

    functions: tuple[ShapeFigure, ...]
    modes: tuple[ModeFigure, ...]
    reading: str
    deviations: tuple[ModeDeviation, ...]
    tip: tuple[TipFigure, ...]
    truth_modes: int


def figures() -> Figures:
    """Return the data of Figures 2–7 for the paper's beam."""
    arm = paper_beam()
    bases: tuple[Basis, Basis] = (ClampedFree(published.FUNCTIONS), Slewing(published.FUNCTIONS))
    cantilever, slewing = (assemble(arm, basis) for basis in bases)
    exact = truth(arm)
    x = np.linspace(0.0, arm.beam.length, _POINTS)
    return Figures(
        tuple(_functions(number, basis, x) for number, basis in zip((2, 3), bases, strict=True)),
        tuple(_mode(number, number, x, cantilever, slewing, exact) for number in (4, 5)),
        READING,
        tuple(
            _deviation(mode, x, cantilever, slewing, exact)
            for mode in range(1, published.FUNCTIONS + 1)
        ),
        (_tip(6, cantilever, exact), _tip(7, slewing, exact)),
        exact.modes,
    )


def _functions(number: int, basis: Basis, x: Array) -> ShapeFigure:
    return ShapeFigure(number, basis.name, x, basis.evaluate(x / x[-1]))


def _mode(
    number: int, mode: int, x: Array, cantilever: Model, slewing: Model, exact: Truth
) -> ModeFigure:
    shapes = [model.displacement(x) @ model.mode_shapes for model in (cantilever, slewing, exact)]
    reference = shapes[2][:, mode : mode + 1]
    first, second = (with_signs_of(reference, y[:, mode : mode + 1])[:, 0] for y in shapes[:2])
    return ModeFigure(number, mode, x, first, second, reference[:, 0])


def _deviation(
    mode: int, x: Array, cantilever: Model, slewing: Model, exact: Truth
) -> ModeDeviation:
    figure = _mode(0, mode, x, cantilever, slewing, exact)
    size = np.abs(figure.truth).max()
    shape = [
        float(np.abs(y - figure.truth).max() / size) for y in (figure.clamped_free, figure.slewing)
    ]
    frequency = [
        float(model.omega[mode - 1] / exact.omega[mode - 1] - 1) for model in (cantilever, slewing)
    ]
    return ModeDeviation(mode, mode + 1, shape[0], shape[1], frequency[0], frequency[1])


def _tip(number: int, model: Model, exact: Truth) -> TipFigure:
    step = published.SAMPLE_TIME
    reference = run(exact, exact_map(exact, step), _HORIZON)
    sampled = run(model, exact_map(model, step), _HORIZON)
    taylor = run(model, taylor_map(model, step), _HORIZON)
    stays = taylor.left_range_s is None
    return TipFigure(
        number,
        model.basis.name,
        sampled,
        taylor,
        reference,
        _largest_gap(sampled, reference),
        _largest_gap(taylor, reference) if stays else None,
    )


def _largest_gap(first: TipRun, second: TipRun) -> float:
    return float(np.abs(first.tip - second.tip).max())
