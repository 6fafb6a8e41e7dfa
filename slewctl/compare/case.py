"""A case: one arm, one objective, one design, and the alternatives to compare it with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

from slewctl.arm import Arm, ModalData
from slewctl.basis import MODAL, NAMES, bases_of
from slewctl.design import METHODS, options
from slewctl.design.methods import GIVEN
from slewctl.errors import InputError, check_choice, check_count, check_each, shown, suggest
from slewctl.loop import Slew
from slewctl.model.converged_truth import DEFAULT_MODES
from slewctl.plant import Objective

# Verdicts are followed over truths of twice the modes up to twice as many.
MOST_TRUTH_MODES = 60
# What is simulated where nobody says.
DEFAULT_SLEW = Slew(angle_deg=30.0, duration_s=2.0)


class Origin(NamedTuple):
    """What a controller was made on, in the words of everything that tells of it.

    Attributes
    ----------
    basis : str
        The basis, or the reduction; empty for a given law, which was made elsewhere.
    n : int
        Flexible modes of the design model; zero for a given law.
    """

    basis: str = ""
    n: int = 0

    def __str__(self) -> str:
        return f"{self.basis}, n = {self.n}" if self.basis else GIVEN

    @property
    def cells(self) -> dict[str, object]:
        """Basis and n as two columns of a table, None where there are none."""
        return {"basis": self.basis or None, "n": self.n or None}


@dataclass(frozen=True)
class Case:
    """A design to be judged on the truth.

    Parameters
    ----------
    name : str
        Short name, such as the design file's stem.
    arm : Arm
    objective : Objective
    basis : str
        Name of the basis that the design model uses (see `slewctl.basis.NAMES`); empty for a
        given law, which has no design model, whatever is passed.
    n : int
        Number of admissible functions of the design model; zero for a given law.
    method : str
        Name of the design method (see `slewctl.design.METHODS`).
    options : mapping of str to object
        The method's own options, such as ``bandwidth_hz``, given to it by keyword.
    slew : Slew
        The turn that is simulated.
    title : str
        One line for the report.
    source : str
        Where the case is described, such as the design file, for messages.
    truth_modes : int
        Flexible modes that the truth keeps; not fewer than any n compared.
    bases : tuple of str
        Bases that a comparison tries; by default, of an arm from modal data, its modes; none
        for a given law.
    orders : tuple of int
        Numbers of functions that a comparison tries.

    Raises
    ------
    InputError
        For unknown names, counts below one, or a truth smaller than a design model.
    """

    name: str
    arm: Arm
    objective: Objective
    basis: str = "clamped-free"
    n: int = 2
    method: str = "lqg"
    options: Mapping[str, Any] = field(default_factory=dict)
    slew: Slew = DEFAULT_SLEW
    title: str = ""
    source: str = ""
    truth_modes: int = DEFAULT_MODES
    bases: tuple[str, ...] = ("clamped-free", "slewing")
    orders: tuple[int, ...] = (1, 2, 3, 4, 5)

    def __post_init__(self) -> None:
        check_choice(self.method, METHODS, "controller.method")
        made_elsewhere = {"basis": "", "n": 0, "bases": (), "orders": ()} if self.is_given else {}
        for name, none in made_elsewhere.items():
            object.__setattr__(self, name, none)
        object.__setattr__(self, "bases", tuple(self.bases))
        object.__setattr__(self, "orders", tuple(self.orders))
        if not self.is_given:
            self._keep_to_modal_data()
            check_choice(self.basis, (*NAMES, MODAL), "model.basis")
            check_count(self.n, "model.n")
        known = options(self.method)
        for key in self.options:
            if key not in known:
                raise InputError(
                    f"method {self.method} has no such option",
                    where=f"controller.{key}",
                    remedy=suggest(key, known) if known else "leave it out",
                )
        choices = bases_of(self.arm)
        check_each(self.bases, "compare.bases", lambda name, at: check_choice(name, choices, at))
        check_each(self.orders, "compare.orders", check_count)
        if self.truth_modes > MOST_TRUTH_MODES:
            raise InputError(
                f"a truth of {shown(self.truth_modes)} modes cannot be judged on twice as many",
                where="truth.modes",
                remedy=f"keep at most {MOST_TRUTH_MODES}",
            )
        largest = max(self.n, *self.orders) if self.orders else self.n
        if largest > MOST_TRUTH_MODES:
            raise InputError(
                f"a model of {shown(largest)} functions is larger than any truth",
                where="model.n"
                if largest == self.n
                else f"compare.orders.{self.orders.index(largest)}",
                remedy=f"design on at most {MOST_TRUTH_MODES // 2}",
            )
        if check_count(self.truth_modes, "truth.modes") < largest:
            raise InputError(
                f"a truth of {self.truth_modes} modes cannot judge a model of {largest} functions"
                + ("" if largest == self.n else ", which compare.orders asks for"),
                where="truth.modes",
                remedy=f"keep at least {min(2 * largest, MOST_TRUTH_MODES)} modes (truth.modes)",
            )

    def _keep_to_modal_data(self) -> None:
        """Compare an arm from modal data on its modes where nobody asks for something else."""
        if not isinstance(self.arm.beam, ModalData):
            return
        given = {field.name: field.default for field in fields(self)}
        if self.bases == given["bases"]:
            object.__setattr__(self, "bases", (MODAL,))
        if self.orders == given["orders"]:
            orders = tuple(n for n in self.orders if n <= self.arm.beam.modes)
            object.__setattr__(self, "orders", orders)

    @property
    def is_given(self) -> bool:
        """Whether the controller was made elsewhere."""
        return self.method == GIVEN

    @property
    def origin(self) -> Origin:
        """What the case's own controller is made on."""
        return Origin(self.basis, self.n)

    @property
    def candidates(self) -> tuple[Origin, ...]:
        """Every basis and n to compare, the case's own included."""
        grid = [Origin(basis, n) for basis in self.bases for n in self.orders]
        return tuple(dict.fromkeys([*grid, self.origin]))


def check_basis(arm: Arm, basis: str, n: int) -> None:
    """Refuse a basis, or a number of functions, that an arm cannot have.

    Parameters
    ----------
    arm : Arm
    basis : str
    n : int

    Raises
    ------
    InputError
    """
    known, beam = bases_of(arm), arm.beam
    if basis not in known:
        what = "has a beam" if basis == MODAL else "is known by its modes alone"
        raise InputError(
            f"{shown(basis)} for an arm that {what}",
            where="model.basis",
            remedy=f"use {' or '.join(known)}",
        )
    if isinstance(beam, ModalData) and n > beam.modes:
        raise InputError(
            f"{shown(n)} modes of an arm whose data give {beam.modes}",
            where="model.n",
            remedy=f"give at most {beam.modes}",
        )
