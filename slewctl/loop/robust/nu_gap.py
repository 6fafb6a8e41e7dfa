"""How far apart two plants are for feedback: Vinnicombe's ν-gap δ(P₁, P₂), from 0 to 1.

G. Vinnicombe, Frequency domain uncertainty and the graph topology, IEEE Trans. Automatic
Control 38, 1993.  A controller bears what its margin b(P, C) says (`ncf_margin`).  Both
compare a unit of input with a unit of output: they depend on the units of the signals.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError, check_positive
from slewctl.loop.parts import Plant, arranged, order, state_space
from slewctl.loop.realisation import Realisation, hertz, realisation
from slewctl.numerics.frequency_response import sample_time
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.matrix_equations import solve_riccati

# Above this the gap is one: the graphs touch to working precision.
_TOUCHING = 1 - 1e-9
_RESIDUAL = 1e-8  # of a Riccati equation, relative: a gap is good to about its root, 1e-4


@dataclass(frozen=True)
class NuGap:
    """The ν-gap between two plants.

    Attributes
    ----------
    value : float
        δ in [0, 1]; one where no controller is sure to fit both.
    frequency_hz : float or None
        Where the plants differ most; None for infinite frequency.
    largest_distance : float
        Largest pointwise chordal distance; the same as `value` where the winding condition
        holds.
    winding : bool
        Whether the winding-number condition holds.
    """

    value: float
    frequency_hz: float | None
    largest_distance: float
    winding: bool


@single_threaded
def nu_gap(
    first: Plant,
    second: Plant,
    *,
    output_scale: Sequence[float] | float = 1.0,
    input_scale: Sequence[float] | float = 1.0,
) -> NuGap:
    """Return the ν-gap between two plants.

    Parameters
    ----------
    first, second : GeneralisedPlant, LinearSystem or control.TransferFunction
        With the same inputs and outputs, matched by name where both plants have names of
        their own, else by position; both continuous or sampled alike; without modes on the
        axis that the inputs do not reach or the outputs do not see.
    output_scale, input_scale : float or sequence of float
        A unit of each output, and of each input, in the first plant's order: the plants are
        compared as y/output_scale against u/input_scale.

    Returns
    -------
    NuGap

    Raises
    ------
    InputError
        If the plants do not fit together, or have a hidden mode on the axis.
    AccuracyError
        If the coprime factors are not normalised to working precision.

    Notes
    -----
    From the normalised right factor of the first and left factor of the second plant, two
    Riccati equations; ‖·‖∞ by level sets; the winding condition from the zeros of
    G₂~G₁, of which as many as the second plant has states must lie in the right half plane.

    Examples
    --------
    >>> import control
    >>> import slewctl as sc
    >>> round(sc.nu_gap(control.tf([1], [1, 1]), control.tf([2], [1, 1])).value, 4)
    0.3333
    """
    one, two = state_space(first, "first"), state_space(second, "second")
    _check_alike(one, two)
    two = arranged(two, one.input_labels, one.output_labels, "second")
    return gap_between(
        plant_graph(one, output_scale=output_scale, input_scale=input_scale, where="first"),
        plant_graph(two, output_scale=output_scale, input_scale=input_scale, where="second"),
    )


@dataclass(frozen=True, eq=False)
class PlantGraph:
    """The graph of a plant, all pairs (u, y) that it admits, as two normalised factors.

    Attributes
    ----------
    system : LinearSystem
    realisation : Realisation
        In the units in which it is compared.
    """

    system: LinearSystem
    realisation: Realisation

    @cached_property
    def right(self) -> Realisation:
        """[N; M], whose range is the graph."""
        return _right_graph(self.realisation)

    @cached_property
    def left(self) -> Realisation:
        """[M̃ −Ñ], whose kernel is the graph."""
        return _left_graph(self.realisation)


def plant_graph(
    system: LinearSystem,
    *,
    output_scale: Sequence[float] | float = 1.0,
    input_scale: Sequence[float] | float = 1.0,
    where: str = "plant",
) -> PlantGraph:
    """Return the graph of a plant, to be compared with several others.

    Parameters
    ----------
    system, output_scale, input_scale
        As for `nu_gap`.
    where : str
        What the plant is called in messages.

    Returns
    -------
    PlantGraph

    Raises
    ------
    InputError
        As `nu_gap`.

    Examples
    --------
    >>> from slewctl.loop import plant_graph
    >>> from slewctl.numerics.linear_system import LinearSystem
    >>> first = LinearSystem([[-1.0]], [[1.0]], [[1.0]], [[0.0]])
    >>> type(plant_graph(first)).__name__
    'PlantGraph'
    """
    found = realisation(system, where)
    units = signal_units(system, output_scale, input_scale)
    p = found.D.shape[0]
    return PlantGraph(system, found.scaled(1 / units[:p], units[p:]).balanced)


def gap_between(first: PlantGraph, second: PlantGraph) -> NuGap:
    """Return the ν-gap between two graphs, their signals in the same order; see `nu_gap`.

    Parameters
    ----------
    first, second : PlantGraph
        From `plant_graph`, in the same units.

    Returns
    -------
    NuGap

    Examples
    --------
    >>> from slewctl.loop import gap_between, plant_graph
    >>> from slewctl.numerics.linear_system import LinearSystem
    >>> first = LinearSystem([[-1.0]], [[1.0]], [[1.0]], [[0.0]])
    >>> second = LinearSystem([[-1.0]], [[1.0]], [[2.0]], [[0.0]])
    >>> round(gap_between(plant_graph(first), plant_graph(second)).value, 4)
    0.3333
    """
    one, two = first.system, second.system
    _check_alike(one, two)
    for own, other, kind in (
        (two.input_labels, one.input_labels, "inputs"),
        (two.output_labels, one.output_labels, "outputs"),
    ):
        if order(own, other, f"second: {kind}") != list(range(len(other))):
            raise InputError(
                f"the {kind} of both plants stand in different orders",
                where="gap_between",
                remedy="give the plants to nu_gap, which matches them by name",
            )
    distance = second.left.after(first.right).peak()
    fits = distance.value < _TOUCHING and _winding(second.right, first.right)
    return NuGap(
        min(distance.value, 1.0) if fits else 1.0,
        hertz(distance.omega, first.system),
        min(distance.value, 1.0),
        fits,
    )


def _check_alike(first: LinearSystem, second: LinearSystem) -> None:
    one, two = (f"{system.noutputs}×{system.ninputs}" for system in (first, second))
    clocks = sample_time(first), sample_time(second)
    if one != two or clocks[0] != clocks[1]:
        raise InputError(
            f"plants of {one} and {two} signals, sampled at {clocks[0]:g} and {clocks[1]:g} s",
            where="nu_gap",
            remedy="compare plants with the same signals and sample time",
        )


def signal_units(
    system: LinearSystem,
    output_scale: Sequence[float] | float,
    input_scale: Sequence[float] | float,
) -> Array:
    """Return the units of all outputs, then of all inputs."""
    return np.concatenate(
        [
            _scale(output_scale, system.noutputs, "output_scale"),
            _scale(input_scale, system.ninputs, "input_scale"),
        ]
    )


def _scale(given: Sequence[float] | float, count: int, name: str) -> Array:
    several = np.ndim(given) > 0
    values = [check_positive(value, name) for value in given] if several else None  # type: ignore[union-attr]
    if values is None:
        return np.full(count, check_positive(given, name))
    if len(values) != count:
        raise InputError(
            f"{len(values)} scales for {count} signals", where=name, remedy="give one for each"
        )
    return np.array(values)


def _right_graph(P: Realisation) -> Realisation:
    """Return [N; M], stable with N~N + M~M = I and P = NM⁻¹ (Zhou et al., theorem 13.37)."""
    m = P.D.shape[1]
    R = np.eye(m) + P.D.T @ P.D
    root = np.linalg.cholesky(np.linalg.inv(R))
    F = _feedback(P, R)
    return Realisation(
        P.A + P.B @ F,
        P.B @ root,
        np.vstack([P.C + P.D @ F, F]),
        np.vstack([P.D @ root, root]),
    )


def _left_graph(P: Realisation) -> Realisation:
    """Return [M̃ −Ñ], stable with P = M̃⁻¹Ñ and zero on the graph of P."""
    p = P.D.shape[0]
    dual = Realisation(P.A.T, P.C.T, P.B.T, P.D.T)
    R = np.eye(p) + P.D @ P.D.T
    root = np.linalg.cholesky(np.linalg.inv(R)).T
    H = _feedback(dual, R).T
    return Realisation(
        P.A + H @ P.C,
        np.hstack([H, -(P.B + H @ P.D)]),
        root @ P.C,
        np.hstack([root, -root @ P.D]),
    )


def _feedback(P: Realisation, R: Array) -> Array:
    """Return F = −R⁻¹(BᵀX + DᵀC) with the stabilising X of the normalised factor."""
    if not P.states:
        return np.zeros((len(R), 0))
    cross = np.linalg.solve(R, P.D.T @ P.C)
    A = P.A - P.B @ cross
    Q = P.C.T @ np.linalg.solve(np.eye(len(P.D)) + P.D @ P.D.T, P.C)
    try:
        with warnings.catch_warnings():
            # Poles almost on the axis, in bad units, are met by a perturbation; the residual
            # that is checked below says whether it did harm.
            warnings.simplefilter("ignore", RuntimeWarning)
            found = solve_riccati(A, P.B, Q, R)
    except AccuracyError as error:
        raise InputError(
            "the plant has no normalised coprime factors to working precision",
            where="nu_gap",
            remedy="leave out modes on the axis that the input does not reach or no output sees",
        ) from error
    if not found.residual <= _RESIDUAL:
        raise AccuracyError(
            f"the Riccati equation of the coprime factors is solved to {found.residual:.0e} only",
            where="nu_gap",
            remedy="give the plant in modal coordinates, or in better units",
        )
    return -found.gain - cross


def _winding(second: Realisation, first: Realisation) -> bool:
    """Whether det G₂~G₁ winds zero times around the origin (see `nu_gap`).

    G₂~G₁ has as many poles in the right half plane as G₂ has states, so that it must have as
    many zeros there.
    """
    mirrored = Realisation(-second.A.T, -second.C.T, second.B.T, second.D.T)
    product = mirrored.after(first)
    if np.linalg.cond(product.D) > 1e12:
        return False
    if not product.states:
        return True
    zeros = np.linalg.eigvals(product.A - product.B @ np.linalg.solve(product.D, product.C))
    return int(np.sum(zeros.real > 0)) == second.states
