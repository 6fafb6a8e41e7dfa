"""Systems and matrices as users give them, of python-control or of slewctl, read in one place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, shown
from slewctl.numerics.linear_system import LinearSystem, clock_unknown, linear, of_kind

if TYPE_CHECKING:
    import control


def static(gain: Array | float, dt: float | None = None) -> LinearSystem:
    """Return a system without states, of shape (outputs, inputs)."""
    D = np.atleast_2d(np.asarray(gain, dtype=float))
    outputs, inputs = D.shape
    return LinearSystem(np.zeros((0, 0)), np.zeros((0, inputs)), np.zeros((outputs, 0)), D, dt)


def read_system(system: object, where: str) -> LinearSystem:
    """Return a state space or transfer function; refuse what is none of finite numbers.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
    where : str
        What it is called in messages.

    Raises
    ------
    InputError
        For anything else, an unknown sample time, entries that are not finite, or a transfer
        function with several signals or more zeros than poles.
    """
    if of_kind(system, "TransferFunction"):
        system = _realised(system, where)
    if clock_unknown(system):
        raise InputError(
            "its sample time is not known", where=where, remedy="give it in seconds, as dt"
        )
    found = linear(system)
    if found is None:
        raise InputError(
            f"{shown(system)} is no state-space system or transfer function",
            where=where,
            remedy="give a control.StateSpace or control.TransferFunction",
        )
    if not found.finite:
        raise InputError("it has entries that are not finite", where=where, remedy="mend them")
    return found


def _realised(system: control.TransferFunction, where: str) -> control.StateSpace | LinearSystem:
    if system.ninputs != 1 or system.noutputs != 1:
        raise InputError(
            "a transfer function with several inputs or outputs",
            where=where,
            remedy="give a control.StateSpace",
        )
    up, down = (np.trim_zeros(np.atleast_1d(p[0][0]), "f") for p in (system.num, system.den))
    if len(up) > len(down):
        raise InputError(
            "more zeros than poles: it has no state space",
            where=where,
            remedy="add poles above the frequencies of interest",
        )
    if not len(up):
        return static(0.0, system.dt).named(system.input_labels, system.output_labels)
    import control  # loaded already: the system is one of its own

    return control.tf2ss(system)


def read_matrix(value: object, name: str) -> Array:
    """Return a matrix of finite numbers; refuse anything else."""
    remedy = "give a matrix of finite numbers"
    try:
        matrix = np.atleast_2d(np.asarray(value, dtype=float))
    except (TypeError, ValueError) as error:
        raise InputError(f"{shown(value)} is no matrix", where=name, remedy=remedy) from error
    if matrix.ndim != 2 or not matrix.size or not np.isfinite(matrix).all():
        raise InputError("it is empty, or not finite", where=name, remedy=remedy)
    return matrix
