"""Loops broken open at several places: return ratios, and the sensitivity of closing them."""

from __future__ import annotations

from collections.abc import Sequence

import control
import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError
from slewctl.frequency import sample_time
from slewctl.loop.realisation import check_system, diagonal


def matrices(system: control.StateSpace) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C and D of a system."""
    A, B, C, D = (np.asarray(getattr(system, name), dtype=float) for name in "ABCD")
    return A, B, C, D


def one_loop(loop: control.StateSpace, channel: int) -> control.StateSpace:
    """Return the return ratio of one channel with all others closed.

    Parameters
    ----------
    loop : control.StateSpace
        L, closed by negative feedback.
    channel : int
        Counted from zero.
    """
    A, B, C, D = matrices(loop)
    others = [i for i in range(len(D)) if i != channel]
    back = np.eye(len(others)) + D[np.ix_(others, others)]
    _require_well_posed(back)
    u = -np.linalg.solve(back, np.hstack([C[others], D[others][:, [channel]]]))
    return control.StateSpace(
        A + B[:, others] @ u[:, :-1],
        B[:, [channel]] + B[:, others] @ u[:, -1:],
        C[[channel]] + D[[channel]][:, others] @ u[:, :-1],
        D[channel, channel] + D[[channel]][:, others] @ u[:, -1:],
        loop.dt,
        inputs=[loop.input_labels[channel]],
        outputs=[loop.output_labels[channel]],
    )


def input_loop(plant: control.StateSpace, controller: control.StateSpace) -> control.StateSpace:
    """Return L = −K G, the loop broken at the plant's inputs.

    Parameters
    ----------
    plant, controller : control.StateSpace
        G and K, connected with a plus sign, u = K y, as all controllers here are.
    """
    return _series(_negative(controller), plant, plant.input_labels)


def output_loop(plant: control.StateSpace, controller: control.StateSpace) -> control.StateSpace:
    """Return L = −G K, the loop broken at the plant's outputs, its sensors (see `input_loop`)."""
    return _series(plant, _negative(controller), plant.output_labels)


def input_output_loop(
    plant: control.StateSpace, controller: control.StateSpace
) -> control.StateSpace:
    """Return the loop broken at the plant's inputs and outputs at once (see `input_loop`).

    With u = −(−K)y and y = −(−G)u its return ratio is [[0, −K], [−G, 0]] on [u; y].
    """
    _check_pair(plant, controller)
    m, p = plant.ninputs, plant.noutputs
    G, K = matrices(plant), matrices(controller)
    states = diagonal(G[0], K[0])
    nothing = np.zeros
    B = diagonal(G[1], K[1])  # the plant takes u, the controller y
    C = -np.vstack(
        [
            np.hstack([nothing((m, len(G[0]))), K[2]]),
            np.hstack([G[2], nothing((p, len(K[0])))]),
        ]
    )
    D = -np.block([[nothing((m, m)), K[3]], [G[3], nothing((p, p))]])
    labels = [*plant.input_labels, *plant.output_labels]
    return control.StateSpace(states, B, C, D, plant.dt, inputs=labels, outputs=_returned(labels))


def sensitivity(loop: control.StateSpace) -> control.StateSpace:
    """Return S = (I + L)⁻¹ of a square loop.

    Raises
    ------
    InputError
        If the loop is not well posed: I + D is singular.
    """
    A, B, C, D = matrices(loop)
    back = np.eye(len(D)) + D
    _require_well_posed(back)
    gain = np.linalg.solve(back, C)
    inverse = np.linalg.inv(back)
    return control.StateSpace(A - B @ gain, B @ inverse, -gain, inverse, loop.dt)


def _require_well_posed(back: Array) -> None:
    if back.size and np.linalg.cond(back) > 1e12:
        raise InputError(
            "the loop is not well posed: I + L is singular at infinite frequency",
            where="multiloop_margins",
            remedy="remove a feedthrough, or change its size",
        )


def _check_pair(plant: control.StateSpace, controller: control.StateSpace) -> None:
    check_system(plant, "plant")
    check_system(controller, "controller")
    if (controller.ninputs, controller.noutputs) != (plant.noutputs, plant.ninputs):
        raise InputError(
            f"a controller from {controller.ninputs} to {controller.noutputs} signals does not fit "
            f"a plant from {plant.ninputs} to {plant.noutputs}",
            where="controller",
            remedy="let it take every output and command every input",
        )
    if sample_time(plant) != sample_time(controller):
        raise InputError(
            f"sample times {sample_time(plant):g} s and {sample_time(controller):g} s differ",
            where="controller",
            remedy="sample both alike",
        )


def _negative(system: control.StateSpace) -> control.StateSpace:
    check_system(system, "controller")
    A, B, C, D = matrices(system)
    return control.StateSpace(A, B, -C, -D, system.dt)


def _series(
    second: control.StateSpace, first: control.StateSpace, labels: Sequence[str]
) -> control.StateSpace:
    """Return second·first with its signals named."""
    _check_pair(first, second)
    A1, B1, C1, D1 = matrices(first)
    A2, B2, C2, D2 = matrices(second)
    return control.StateSpace(
        np.block([[A1, np.zeros((len(A1), len(A2)))], [B2 @ C1, A2]]),
        np.vstack([B1, B2 @ D1]),
        np.hstack([D2 @ C1, C2]),
        D2 @ D1,
        first.dt,
        inputs=list(labels),
        outputs=_returned(labels),
    )


def _returned(labels: Sequence[str]) -> list[str]:
    return [f"returned_{name}" for name in labels]
