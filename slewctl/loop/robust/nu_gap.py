"""How far apart two plants are for feedback: Vinnicombe's ν-gap δ(P₁, P₂), from 0 to 1.

G. Vinnicombe, Frequency domain uncertainty and the graph topology, IEEE Trans. Automatic
Control 38, 1993.  A controller bears what its margin b(P, C) says (`ncf_margin`).  Both
compare a unit of input with a unit of output: they depend on the units of the signals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.errors import InputError, check_positive
from slewctl.loop.parts import Plant, arranged, order, state_space
from slewctl.loop.realisation import Realisation, hertz, realisation
from slewctl.loop.robust.angle_search import KNOWN, TOUCHING, UndecidedAngleError, extreme
from slewctl.loop.robust.coprime_factors import left_graph, right_graph, winding
from slewctl.loop.robust.graph_line import GraphLine
from slewctl.loop.robust.line_pair import Distance
from slewctl.loop.single.factor import factor_of
from slewctl.numerics.frequency_response import sample_time
from slewctl.numerics.linear_system import LinearSystem


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
    bounds : tuple of float or None
        The gap is between them, proved by intervals over the whole axis, rounding included:
        no more than 1e-9 apart, or `doubt` says why.  None where the gap is computed and not
        proved: of plants with several inputs and several outputs, and with several poles at
        one place of the axis beside the origin.
    intervals : int
        How many proved it.
    doubt : str
        Why the bounds are wider; empty where they are not.
    """

    value: float
    frequency_hz: float | None
    largest_distance: float
    winding: bool
    bounds: tuple[float, float] | None = None
    intervals: int = 0
    doubt: str = ""


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
    With one input, or one output, a plant at each frequency is a line through (1, P), and the
    distance the sine of the angle between two lines: enclosed on intervals of the axis, each of
    which is halved until it proves that the sine is nowhere larger than the largest one seen,
    but for 5·10⁻¹⁰, and by how much arg(1 + P₂*P₁) changes, from which the winding condition
    follows.  Where both plants have nearly the same pole its contribution to their difference
    is bounded by itself.

    With several of both, from the normalised right factor of the first and left factor of the
    second plant, two Riccati equations; ‖·‖∞ by level sets; the winding condition from the
    zeros of G₂~G₁, of which as many as the second plant has states must lie in the right half
    plane.

    Examples
    --------
    >>> import control
    >>> import slewctl as sc
    >>> gap = sc.nu_gap(control.tf([1], [1, 1]), control.tf([2], [1, 1]))
    >>> round(gap.value, 4)
    0.3333
    >>> gap.bounds[0] <= 1 / 3 <= gap.bounds[1] < gap.bounds[0] + 1e-9
    True
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
    """The graph of a plant, all pairs (u, y) that it admits.

    Attributes
    ----------
    system : LinearSystem
    units : ndarray, shape (outputs + inputs,)
        In which its signals are compared.
    where : str
        What the plant is called in messages.
    """

    system: LinearSystem
    units: Array
    where: str

    @property
    def is_line(self) -> bool:
        """Whether it, or what is orthogonal to it, has one dimension at each frequency."""
        return 1 in (self.system.ninputs, self.system.noutputs)

    @cached_property
    def line(self) -> GraphLine:
        """The line at each frequency, of the dual plant where there are several inputs."""
        p = self.system.noutputs
        return graph_line(self.system, self.units[p:] / self.units[:p], self.where)

    @cached_property
    def realisation(self) -> Realisation:
        """In the units in which it is compared."""
        p = self.system.noutputs
        found = realisation(self.system, self.where)
        return found.scaled(1 / self.units[:p], self.units[p:]).balanced

    @cached_property
    def right(self) -> Realisation:
        """[N; M], whose range is the graph."""
        return right_graph(self.realisation)

    @cached_property
    def left(self) -> Realisation:
        """[M̃ −Ñ], whose kernel is the graph."""
        return left_graph(self.realisation)


def graph_line(system: LinearSystem, scale: Array, where: str) -> GraphLine:
    """Return the line of a system with one input, or that of its dual, which has one output.

    Parameters
    ----------
    system : LinearSystem
    scale : ndarray, shape (p,)
        By which the several signals are multiplied.
    where : str
        What the system is called in messages.

    Raises
    ------
    InputError
        If a sampled system has a pole at z = −1.
    """
    if system.ninputs > 1:
        A, B, C, D = system.matrices
        system = LinearSystem(A.T, C.T, B.T, D.T, system.dt)
    factor = factor_of(system)
    if factor.has_end:
        raise InputError(
            "the sampled system has a pole at z = −1, half the sampling frequency",
            where=where,
            remedy="change the sample time, or move the pole",
        )
    return GraphLine(factor, scale)


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
    return PlantGraph(system, signal_units(system, output_scale, input_scale), where)


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
    doubt = ""
    if first.is_line:
        try:
            return _proved(first, second)
        except UndecidedAngleError as error:
            doubt = f"not proved: {error}"
    distance = second.left.after(first.right).peak()
    fits = distance.value < TOUCHING and winding(second.right, first.right)
    return NuGap(
        min(distance.value, 1.0) if fits else 1.0,
        hertz(distance.omega, first.system),
        min(distance.value, 1.0),
        fits,
        doubt=doubt,
    )


def _proved(first: PlantGraph, second: PlantGraph) -> NuGap:
    """Return the gap of two lines."""
    one, two = first.line, second.line
    found = extreme(Distance(one, two))
    touching = found.value >= TOUCHING
    turns = None if touching else found.turn
    excess = one.unstable - two.unstable + (one.order - two.order) / 2
    fits = turns is not None and bool(abs(turns / np.pi - excess) < 0.25)
    bounds, doubt = (found.lower, found.upper), ""
    if not fits:
        bounds = (found.lower if touching or turns is None else 1.0, 1.0)
    if bounds[1] - bounds[0] > KNOWN:
        doubt = "the winding condition" if turns is None and not touching else "the distance"
        doubt += " is hidden by rounding"
    return NuGap(
        found.value if fits else 1.0,
        found.hertz(first.system.sample_time),
        found.value,
        fits,
        bounds,
        found.intervals,
        doubt,
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
