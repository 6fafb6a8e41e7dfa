"""How much of a gap between two plants a controller bears.

The generalised stability margin b(P, C) = 1/‖[I; C](I − PC)⁻¹[I P]‖∞ lies between 0 and 1: if
b(P₁, C) > δ(P₁, P₂), the ν-gap, then C stabilises P₂ too, with
b(P₂, C) >= sin(arcsin b(P₁, C) − arcsin δ) (G. Vinnicombe, Frequency domain uncertainty and the
graph topology, IEEE Trans. Automatic Control 38, 1993).

As the gap it depends on the units of the signals: a test in rad and N·m may fail where one in
other units succeeds.  `best_output_scale` finds the units in which the margin is largest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.design import Controller
from slewctl.errors import InputError
from slewctl.loop.parts import Pair, Plant, System, paired
from slewctl.loop.realisation import Realisation, check_well_posed, hertz, realisation
from slewctl.loop.robust.angle_search import KNOWN, UndecidedAngleError, extreme
from slewctl.loop.robust.line_pair import Kept
from slewctl.loop.robust.mu import balanced_scales, minimised
from slewctl.loop.robust.nu_gap import graph_line, signal_units
from slewctl.numerics.frequency_response import FrequencyResponse

# The best units are sought within this factor, in nepers, and to this accuracy of b.
_SEARCHED, _ENOUGH = 7.0, 1e-2
# A frequency in rad/s that stands for infinity.
_VERY_FAST = 1e12


@dataclass(frozen=True)
class GeneralisedMargin:
    """The generalised stability margin b(P, C).

    Attributes
    ----------
    value : float
        Zero for an unstable loop.
    frequency_hz : float or None
        Where the loop is most sensitive; None for infinite frequency or an unstable loop.
    stable : bool
    bounds : tuple of float or None
        The margin is between them, proved as `NuGap.bounds` are; None where those are.
    intervals : int
        How many proved it.
    doubt : str
        Why the bounds are more than 1e-9 apart, or what was not proved; empty else.
    """

    value: float
    frequency_hz: float | None
    stable: bool
    bounds: tuple[float, float] | None = None
    intervals: int = 0
    doubt: str = ""


def ncf_margin(
    plant: Plant,
    controller: Controller | System,
    *,
    sign: int | None = None,
    output_scale: Sequence[float] | float = 1.0,
    input_scale: Sequence[float] | float = 1.0,
) -> GeneralisedMargin:
    """Return the generalised stability margin b(P, C).

    Parameters
    ----------
    plant : GeneralisedPlant, LinearSystem or control.TransferFunction
    controller : Controller, LinearSystem or control.TransferFunction
        Its signals are matched with the plant's by name where both have names of their own,
        else by position.
    sign : {-1, 1}, optional
        Of the feedback, u = sign·C y, as in `control.feedback`: −1 unless told otherwise.  A
        slewctl `Controller` knows its own, +1.
    output_scale, input_scale : float or sequence of float
        A unit of each signal of the plant (see `nu_gap`); the same as there to compare the two.

    Returns
    -------
    GeneralisedMargin

    Raises
    ------
    InputError
        If they do not fit together, or the loop is not well posed.

    Notes
    -----
    With one input, or one output, the least sine between the line of the plant and what is
    orthogonal to that of the controller, by intervals over the whole axis as `nu_gap`; stability
    from the turns of 1 + L.  With several of both, ‖·‖∞ by level sets.

    Examples
    --------
    >>> import control
    >>> import slewctl as sc
    >>> b = sc.ncf_margin(control.tf([1], [1, 0]), 2.0)
    >>> round(b.value, 4)  # 1/√5 of an integrator
    0.4472
    >>> b.bounds[0] <= 5**-0.5 <= b.bounds[1] < b.bounds[0] + 1e-9
    True
    """
    pair = paired(plant, controller, sign).on_one_clock()
    units = signal_units(pair.plant, output_scale, input_scale)
    doubt = ""
    if 1 in (pair.plant.ninputs, pair.plant.noutputs):
        try:
            return _proved(pair, units)
        except UndecidedAngleError as error:
            doubt = f"not proved: {error}"
    closed = _closed(pair)
    if not closed.stable:
        return GeneralisedMargin(0.0, None, False, doubt=doubt)
    peak = closed.scaled(1 / units, units).peak()
    return GeneralisedMargin(1 / peak.value, hertz(peak.omega, pair.plant), True, doubt=doubt)


def _proved(pair: Pair, units: Array) -> GeneralisedMargin:
    """Return the margin that a controller keeps of the angle between two lines."""
    check_well_posed(pair.plant.D, pair.positive.D)
    p = pair.plant.noutputs
    scale = units[p:] / units[:p]
    plant = graph_line(pair.plant, scale, "plant")
    controller = graph_line(pair.negative, 1 / scale, "controller")
    found = extreme(Kept(plant, controller))
    doubt = "the margin is hidden by rounding" if found.upper - found.lower > KNOWN else ""
    if found.turn is None:
        stable, doubt = _closed(pair).stable, "stability is what computed poles say of it"
    else:
        turns = found.turn / np.pi - (plant.order + controller.order) / 2
        stable = abs(plant.unstable + controller.unstable - turns) < 0.25
    if not stable:
        doubt = "" if found.turn is not None else doubt
        return GeneralisedMargin(0.0, None, False, (0.0, 0.0), found.intervals, doubt)
    return GeneralisedMargin(
        found.value,
        found.hertz(pair.plant.sample_time),
        True,
        (found.lower, found.upper),
        found.intervals,
        doubt,
    )


def _closed(pair: Pair) -> Realisation:
    return realisation(pair.plant, "plant").closed(realisation(pair.positive, "controller"))


def best_output_scale(
    plant: Plant, controller: Controller | System, *, sign: int | None = None
) -> Array:
    """Return units of the outputs, the inputs' being one, in which b(P, C) is largest.

    Parameters
    ----------
    plant, controller, sign
        As for `ncf_margin`, with one input, stable when closed.

    Returns
    -------
    ndarray, shape (outputs,)
        The search is over a convex function of their logarithms.

    Raises
    ------
    InputError
        If the loop is unstable, or the plant has several inputs.

    Examples
    --------
    >>> import control
    >>> G = control.ss([[-1.0]], [[1.0]], [[1.0], [2.0]], 0)
    >>> from slewctl.loop import best_output_scale
    >>> K = control.ss([], [], [], [[1.0, 1.0]])
    >>> best_output_scale(G, K).shape
    (2,)
    """
    pair = paired(plant, controller, sign).on_one_clock()
    closed = _closed(pair)
    if pair.plant.ninputs != 1 or not closed.stable:
        raise InputError(
            "scales are found for a stable loop with one input",
            where="best_output_scale",
            remedy="give units of your own",
        )
    response = FrequencyResponse(closed.system)

    def size(log: Array) -> tuple[float, Array]:
        scale = np.exp(-np.append(log, 0.0))
        peak = closed.scaled(scale, 1 / scale).peak()
        at = response(np.array([min(peak.omega, _VERY_FAST)]))[0]
        U, _, Vh = np.linalg.svd(scale[:, None] * at / scale)
        return peak.value, (np.abs(Vh[0]) ** 2 - np.abs(U[:, 0]) ** 2)[:-1]

    # Units that balance the largest entries over the poles' frequencies, to begin with.
    known = response.landmarks
    entries = np.abs(response(known[known > 0])).max(axis=0)
    start = -np.log(balanced_scales(entries[None])[0][:-1])
    return np.asarray(np.exp(minimised(size, start, _SEARCHED, _ENOUGH)[0]))
