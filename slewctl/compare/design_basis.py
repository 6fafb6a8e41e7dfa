"""What a controller is designed on: functions of a basis, or a reduction of the truth.

A basis is chosen before modelling, a reduction is made after it, from a truth that had to
be computed first.  Both give a small plant with the same number of states, and nothing of
the truth beside it reaches the design.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from slewctl import plant as plants
from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis import MODAL, NAMES, create
from slewctl.design import METHODS, Controller
from slewctl.errors import InputError, check_choice, check_count
from slewctl.model import Model, Truth, assemble
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant, Objective, generalised_plant

if TYPE_CHECKING:
    from slewctl.plant import Reduced

# A reduction is loaded where one is made.
REDUCTIONS: dict[str, Callable[[GeneralisedPlant, int], Reduced]] = {
    "balanced-truncation": lambda plant, n: plants.balanced_truncation(plant, 2 * n + 2),
    "balanced-control-path": lambda plant, n: plants.balanced_truncation(
        plant, 2 * n + 2, path="control"
    ),
    "modal-truncation": lambda plant, n: plants.modal_truncation(plant, n, False),
    "modal-truncation-static": lambda plant, n: plants.modal_truncation(plant, n, True),
}
"""Reductions of the truth to n flexible modes, or 2n flexible states, by name."""

SOURCES = (*NAMES, *REDUCTIONS)
"""All that a design model can be made of."""


@dataclass(frozen=True, eq=False)
class DesignModel:
    """A small model, and how a controller made on it is used on the arm.

    Attributes
    ----------
    source : str
        Of `SOURCES`: a basis, or a reduction of the truth.
    n : int
        Flexible modes.
    plant : GeneralisedPlant
    model : Model or None
        None for a reduction, which has matrices only.
    reduced : Reduced or None
    """

    source: str
    n: int
    plant: GeneralisedPlant
    model: Model | None = None
    reduced: Reduced | None = None

    @property
    def omega(self) -> Array:
        """Natural frequencies of the flexible modes in rad/s, increasing, shape (≤ n,)."""
        if self.model is not None:
            return self.model.omega
        # A reduction keeps the rigid body apart, in its first states; one pole of each pair.
        rigid = sum(name.startswith("rigid") for name in self.plant.linear.state_labels)
        return np.sort(np.abs(np.linalg.eigvals(self.plant.A[rigid:, rigid:])))[::2]

    @property
    def path(self) -> LinearSystem:
        """From the actuator to the sensors, with the static correction of a reduction."""
        path = self.plant.path
        if self.reduced is None or not self.reduced.feedthrough.size:
            return path
        return LinearSystem(
            path.A, path.B, path.C, np.asarray(path.D) + self.reduced.feedthrough,
            inputs=path.input_labels, outputs=path.output_labels,
        )  # fmt: skip

    def controller(self, method: str, options: Mapping[str, object]) -> Controller:
        """Return what a method of `slewctl.design.METHODS` makes of the plant alone."""
        made = METHODS[method](self.plant, **options)
        if self.reduced is None:
            return made
        before = made.continuous
        if before is not None:
            before = replace(before, system=self.reduced.corrected(before.linear))
        return replace(made, system=self.reduced.corrected(made.linear), continuous=before)


def design_model(truth: Truth, objective: Objective, source: str, n: int) -> DesignModel:
    """Return the model of n flexible modes that a basis or a reduction gives.

    Parameters
    ----------
    truth : Truth
        Of a basis only its arm is used; a reduction is made of the truth itself.
    objective : Objective
    source : str
        Of `SOURCES`, or ``modal`` for an arm from modal data.
    n : int

    Returns
    -------
    DesignModel

    Raises
    ------
    InputError
        For an unknown source, an n that is no reduction of the truth, or a reduction that
        needs damped modes where there are undamped ones.
    AccuracyError
        If a reduction is not confirmed by its own checks.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> from slewctl.compare import design_model
    >>> reduced = design_model(problem.truth, problem.objective, "balanced-truncation", 2)
    >>> len(reduced.plant.A)
    6
    """
    check_choice(source, (*SOURCES, MODAL), "basis")
    if source in (*NAMES, MODAL):
        model = _assembled(truth.arm, source, n)
        return DesignModel(source, n, generalised_plant(model, objective), model)
    check_reducible(truth.modes, n, "n")
    reduced = REDUCTIONS[source](generalised_plant(truth, objective), n)
    if reduced.plant is None:
        raise TypeError("a reduced generalised plant is one again")
    return DesignModel(source, n, reduced.plant, None, reduced)


def check_reducible(modes: int, n: int, where: str) -> None:
    """Refuse an n to which a truth of so many modes cannot be reduced."""
    if check_count(n, where) >= modes:
        raise InputError(
            f"the truth has {modes} modes, there is nothing to reduce",
            where=where,
            remedy=f"give at most {modes - 1}",
        )


@lru_cache(maxsize=64)
def _assembled(arm: Arm, basis: str, n: int) -> Model:
    """Return a Galerkin model; methods, sensors and bandwidths of a study share it."""
    return assemble(arm, create(basis, n))
