"""Loops broken open at several places: return ratios, and the sensitivity of closing them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import Array
from slewctl.design import Controller
from slewctl.errors import InputError
from slewctl.loop.parts import Plant, System, arranged, feedback_sign, negated, paired
from slewctl.numerics.interconnect import diagonal, series
from slewctl.numerics.linear_system import LinearSystem

if TYPE_CHECKING:
    import control

_RETURNED = "returned_"


def one_loop(loop: LinearSystem, channel: int) -> LinearSystem:
    """Return the return ratio of one channel with all others closed.

    Parameters
    ----------
    loop : LinearSystem
        L, closed by negative feedback.
    channel : int
        Counted from zero.
    """
    A, B, C, D = loop.matrices
    others = [i for i in range(len(D)) if i != channel]
    back = np.eye(len(others)) + D[np.ix_(others, others)]
    _require_well_posed(back)
    u = -np.linalg.solve(back, np.hstack([C[others], D[others][:, [channel]]]))
    return LinearSystem(
        A + B[:, others] @ u[:, :-1],
        B[:, [channel]] + B[:, others] @ u[:, -1:],
        C[[channel]] + D[[channel]][:, others] @ u[:, :-1],
        D[channel, channel] + D[[channel]][:, others] @ u[:, -1:],
        loop.dt,
        inputs=[loop.input_labels[channel]],
        outputs=[loop.output_labels[channel]],
    )


def input_loop(
    plant: Plant, controller: Controller | System, *, sign: int | None = None
) -> control.StateSpace:
    """Return L = K G, the loop broken at the plant's inputs, for negative feedback.

    Parameters
    ----------
    plant : GeneralisedPlant, control.StateSpace or control.TransferFunction
        G.
    controller : Controller, control.StateSpace or control.TransferFunction
        K.  Its signals are matched with the plant's by name where both have names of their
        own, else by position.
    sign : {-1, 1}, optional
        Of the feedback, u = sign·K y, as in `control.feedback`: −1 unless told otherwise.  A
        slewctl `Controller` knows its own, +1: L is then −K G.

    Returns
    -------
    control.StateSpace

    Raises
    ------
    InputError
        If plant and controller do not fit together.

    Examples
    --------
    >>> import control
    >>> from slewctl.loop import input_loop
    >>> G = control.ss([[-1.0]], [[1.0]], [[1.0], [2.0]], 0)
    >>> K = control.ss([], [], [], [[3.0, 4.0]])
    >>> input_loop(G, K).ninputs
    1
    """
    pair = paired(plant, controller, sign).on_one_clock()
    return _labelled(series(pair.plant, pair.negative), pair.plant.input_labels)


def output_loop(
    plant: Plant, controller: Controller | System, *, sign: int | None = None
) -> control.StateSpace:
    """Return L = G K, the loop broken at the plant's outputs, its sensors (see `input_loop`).

    Parameters
    ----------
    plant, controller, sign
        As for `input_loop`.

    Returns
    -------
    control.StateSpace

    Examples
    --------
    >>> import control
    >>> from slewctl.loop import output_loop
    >>> G = control.ss([[-1.0]], [[1.0]], [[1.0], [2.0]], 0)
    >>> K = control.ss([], [], [], [[3.0, 4.0]])
    >>> output_loop(G, K).ninputs
    2
    """
    pair = paired(plant, controller, sign).on_one_clock()
    return _labelled(series(pair.negative, pair.plant), pair.plant.output_labels)


def input_output_loop(
    plant: Plant, controller: Controller | System, *, sign: int | None = None
) -> control.StateSpace:
    """Return the loop broken at the plant's inputs and outputs at once (see `input_loop`).

    With u = −K y and y = −(−G)u its return ratio is [[0, K], [−G, 0]] on [u; y].

    Parameters
    ----------
    plant, controller, sign
        As for `input_loop`.

    Returns
    -------
    control.StateSpace

    Examples
    --------
    >>> import control
    >>> from slewctl.loop import input_output_loop
    >>> G = control.ss([[-1.0]], [[1.0]], [[1.0], [2.0]], 0)
    >>> K = control.ss([], [], [], [[3.0, 4.0]])
    >>> input_output_loop(G, K).ninputs
    3
    """
    pair = paired(plant, controller, sign).on_one_clock()
    m, p = pair.plant.ninputs, pair.plant.noutputs
    G, K = pair.plant.matrices, pair.negative.matrices
    nothing = np.zeros
    C = np.vstack(
        [
            np.hstack([nothing((m, len(G[0]))), K[2]]),
            np.hstack([-G[2], nothing((p, len(K[0])))]),
        ]
    )
    D = np.block([[nothing((m, m)), K[3]], [-G[3], nothing((p, p))]])
    # The plant takes u, the controller y.
    both = LinearSystem(diagonal(G[0], K[0]), diagonal(G[1], K[1]), C, D, pair.plant.dt)
    return _labelled(both, [*pair.plant.input_labels, *pair.plant.output_labels])


def for_negative_feedback(loop: LinearSystem, sign: int | None) -> LinearSystem:
    """Return a square return ratio L as it enters I + L, its outputs in the inputs' order.

    Parameters
    ----------
    loop : LinearSystem
        An output that returns the input x may be called x or ``returned_x``.
    sign : {-1, 1}, optional
        Of the feedback, −1 unless told otherwise.

    Raises
    ------
    InputError
        If it has several channels with names of their own that do not return each other, or
        the sign is impossible.
    """
    negative = feedback_sign(sign) < 0
    if loop.ninputs > 1:
        names = [label.removeprefix(_RETURNED) for label in loop.output_labels]
        named = loop.named(outputs=names)
        loop = arranged(named, loop.input_labels, loop.input_labels, "loop")
    return loop if negative else negated(loop)


def sensitivity(loop: LinearSystem) -> LinearSystem:
    """Return S = (I + L)⁻¹ of a square loop.

    Raises
    ------
    InputError
        If the loop is not well posed: I + D is singular.
    """
    A, B, C, D = loop.matrices
    back = np.eye(len(D)) + D
    _require_well_posed(back)
    gain = np.asarray(np.linalg.solve(back, C), dtype=float)
    inverse = np.asarray(np.linalg.inv(back), dtype=float)
    return LinearSystem(A - B @ gain, B @ inverse, -gain, inverse, loop.dt)


def _require_well_posed(back: Array) -> None:
    if back.size and np.linalg.cond(back) > 1e12:
        raise InputError(
            "the loop is not well posed: I + L is singular at infinite frequency",
            where="multiloop_margins",
            remedy="remove a feedthrough, or change its size",
        )


def _labelled(loop: LinearSystem, labels: Sequence[str]) -> control.StateSpace:
    """Return a return ratio with the names of what goes round it."""
    outputs = [f"{_RETURNED}{name}" for name in labels]
    return loop.named(inputs=labels, outputs=outputs).to_control()
