"""A reduced system, and how far it is from the one it was made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from slewctl._show import Described
from slewctl._types import Array
from slewctl.errors import InputError, shown
from slewctl.numerics.interconnect import behind_feedthrough
from slewctl.numerics.linear_system import WithSystem, alike, holding_light, linear
from slewctl.plant.problem import GeneralisedPlant

if TYPE_CHECKING:
    import control


@holding_light
@dataclass(frozen=True, eq=False, repr=False)
class Reduced(Described, WithSystem):
    """A reduced system, and how far it is from the one it was made of.

    Attributes
    ----------
    system : control.StateSpace
        With the names of the inputs and outputs kept.
    plant : GeneralisedPlant or None
        The same as a generalised plant, where it was made from one; its ``model`` is None.
    method : str
    order : int
        States, the rigid body's included.
    bound : float
        Upper bound of ‖G − Gr‖∞, every signal counted in its `size`; infinite when an
        undamped mode was removed.
    error : float
        The largest singular value of G − Gr found at any pole's frequency, at zero and at
        infinity: a lower bound of the same norm.
    hankel : ndarray
        Hankel singular values, decreasing: for balanced truncation of the whole flexible
        part, for modal truncation of what was removed.
    sizes : mapping of str to float
        The unit in which each signal was counted; absent signals were left out.
    residual : float
        Largest relative residual of the Lyapunov equations and of the separation.
    feedthrough : ndarray, shape (sensors, 1)
        Static response of the removed modes from the actuator to the sensors that `plant`
        leaves out and `corrected` gives to a controller; zero without static correction.
    """

    system: control.StateSpace
    plant: GeneralisedPlant | None
    method: str
    order: int
    bound: float
    error: float
    hankel: Array
    sizes: Mapping[str, float]
    residual: float
    feedthrough: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __str__(self) -> str:
        return f"{self.method} to {self.order} states: error {self.error:.3g} to {self.bound:.3g}"

    def corrected(self, controller: Any) -> Any:
        """Return a controller that expects the static response of the removed modes.

        Designed on `plant`, where y₀ = C x, a controller u = K(s) y₀ is given y − D u
        instead of y, with D the `feedthrough`: the loop of K around the plant with the
        feedthrough is the loop of K₀ around the plant without (Zhou, Doyle and Glover,
        Robust and Optimal Control, section 17.2).

        Parameters
        ----------
        controller : control.StateSpace
            From the sensors to the actuator, connected with a plus sign.

        Raises
        ------
        InputError
            If it is of another shape, or its own feedthrough meets that of the plant in an
            algebraic loop without solution.
        """
        D = self.feedthrough
        if D.size == 0:
            return controller
        light = linear(controller)
        if light is None or light.D.shape != D.T.shape:
            raise InputError(
                f"{shown(controller)} is no controller from {len(D)} sensors to one actuator",
                where="corrected",
                remedy="give the system of a design on this reduced plant",
            )
        if abs(1 + (light.D @ D)[0, 0]) <= np.sqrt(np.finfo(float).eps):
            raise InputError(
                "the controller's feedthrough and the plant's make a loop without solution",
                where="corrected",
                remedy="use a strictly proper controller",
            )
        corrected = behind_feedthrough(light, D).named(name=f"{light.name}_corrected")
        return alike(controller, corrected)
