"""The modes that an arm's own data give, as its functions: nothing is known between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NoReturn

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm, ModalData
from slewctl.basis.combined import Combined
from slewctl.basis.contract import Basis, Growth
from slewctl.basis.with_joint import WithJoint
from slewctl.errors import InputError

MODAL = "modal"
"""The name of the only basis that an arm from modal data has."""


@dataclass(frozen=True)
class Modal(Basis):
    """The first `n` hub-locked modes of an arm from modal data.

    A model on them has the whole inertia of the arm, and none of the modes left out.

    Parameters
    ----------
    n : int
        How many modes; not more than the data have.

    Raises
    ------
    InputError
        If n < 1; when matched to an arm, if that has a beam, or fewer modes.

    Examples
    --------
    >>> import slewctl as sc
    >>> wings = sc.ModalData(inertia=600.0, frequencies_hz=(0.2, 1.3), coupling=(20.0, 4.0))
    >>> sc.assemble(sc.Arm(wings), sc.Modal(1)).frequencies_hz.round(3).tolist()
    [0.346]
    """

    name: ClassVar[str] = MODAL

    def _matched_to(self, arm: Arm) -> Modal:
        if not isinstance(arm.beam, ModalData):
            raise InputError(
                f"{arm.name} has a beam and no modal data",
                where="basis",
                remedy="use another basis, such as arm-matched",
            )
        if self.n > arm.beam.modes:
            raise InputError(
                f"{self.n} modes of an arm whose data give {arm.beam.modes}",
                where="basis",
                remedy=f"give at most n = {arm.beam.modes}",
            )
        return self

    @property
    def needs_beam(self) -> bool:
        return False

    def tip_values(self, coefficients: Array) -> Array:
        """Return the sum of the modal coordinates: any sign does, where nothing is seen."""
        return coefficients.sum(axis=0, keepdims=True)

    @property
    def growth(self) -> Growth:
        self._refuse()

    def _evaluate(self, xi: Array, derivative: int) -> Array:
        self._refuse()

    def _refuse(self) -> NoReturn:
        raise InputError(
            "of an arm from modal data nothing is known along its length",
            where=MODAL,
            remedy="ask for the places that the data tell of",
        )


def modal_rows(basis: Basis, values: Array) -> Array:
    """Return what `values`, one for each mode of the data, are for each function of `basis`.

    Parameters
    ----------
    basis : Basis
        `Modal`, with a joint's twist, or combinations of these.
    values : ndarray, shape (modes,)

    Returns
    -------
    ndarray, shape (basis.n,)

    Examples
    --------
    >>> import numpy as np
    >>> from slewctl.basis import Modal, modal_rows
    >>> modal_rows(Modal(2), np.array([0.1, 0.2, 0.3])).tolist()
    [0.1, 0.2]
    """
    if isinstance(basis, Combined):
        return np.asarray(modal_rows(basis.parent, values) @ basis.coefficients)
    if isinstance(basis, WithJoint):
        return np.concatenate([[0.0], modal_rows(basis.parent, values)])
    return values[: basis.n]
