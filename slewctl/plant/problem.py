"""The generalised plant w, u → z, y that H2 methods design on, and the loop around it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from slewctl._show import Described
from slewctl._types import Array
from slewctl.errors import InputError, shown
from slewctl.model import Model
from slewctl.numerics.interconnect import AlgebraicLoopError, lft
from slewctl.numerics.linear_system import (
    LinearSystem,
    WithSystem,
    alike,
    clock_unknown,
    holding_light,
    linear,
)
from slewctl.plant.objective import Objective

if TYPE_CHECKING:
    import control


@holding_light
@dataclass(frozen=True, eq=False, repr=False)
class GeneralisedPlant(Described, WithSystem):
    """A plant with named disturbances, controls, performance outputs and measurements.

        ẋ = A x + B₁ w + B₂ u,   z = C₁ x + D₁₁ w + D₁₂ u,   y = C₂ x + D₂₁ w + D₂₂ u,

    or x⁺ = … where the system is sampled.  `lqr`, `kalman` and `lqg` take both, and any of
    the matrices; what a method cannot take into account it refuses by name.

    Parameters
    ----------
    system : control.StateSpace
        Any number of disturbances w, then the actuator u; any number of performance outputs
        z, then the sensors.  Continuous, or sampled with its sample time in s.
    sensors : tuple of str
        Names of the measurements y: the system's last outputs.
    model : Model, optional
        What the plant was made of, for methods that need more than its matrices.
    objective : Objective, optional
    undelayed : GeneralisedPlant, optional
        The same without its `dead_time`, which `system` has as a Padé approximation.
    dead_time : float
        In s, between the controller's command and the actuator.

    Raises
    ------
    InputError
        If the system is of another kind, not finite, or without states, w, z or y.
    """

    system: control.StateSpace
    sensors: tuple[str, ...]
    model: Model | None = None
    objective: Objective | None = None
    undelayed: GeneralisedPlant | None = None
    dead_time: float = 0.0

    def __str__(self) -> str:
        w, z = self.linear.input_labels[:-1], self.linear.output_labels[: self.performance]
        clock = f", every {self.sample_time:g} s" if self.sample_time else ""
        clock += f", {self.dead_time:g} s late by Padé's approximation" if self.dead_time else ""
        return (
            f"plant of {self.linear.nstates} states{clock}: {', '.join([*w, self.actuator])} to "
            f"{', '.join([*z, *self.sensors])}"
        )

    def __post_init__(self) -> None:
        _check_system(vars(self).get("_given"), vars(self)["_linear"])
        sensors = (self.sensors,) if isinstance(self.sensors, str) else tuple(self.sensors)
        outputs = list(self.linear.output_labels)
        if not sensors or outputs[-len(sensors) :] != list(sensors):
            raise InputError(
                f"the sensors {list(sensors)} are not the last outputs of {outputs}",
                where="sensors",
                remedy="order the outputs z first, then y, and name the sensors in that order",
            )
        object.__setattr__(self, "sensors", sensors)
        if not self.linear.nstates or self.disturbances < 1 or self.performance < 1:
            raise InputError(
                "the plant has no states, no disturbance or no performance output",
                where="system",
                remedy="give at least one of each: inputs w then the actuator, outputs z then "
                "the sensors",
            )

    @property
    def exact(self) -> GeneralisedPlant:
        """The plant without its dead time's approximation; itself where it has none."""
        return self if self.undelayed is None else self.undelayed

    @property
    def sample_time(self) -> float:
        """T in s of a sampled plant; zero for a continuous one."""
        return self.linear.sample_time

    @property
    def actuator(self) -> str:
        """Name of the control input; ``torque`` or ``voltage`` for an arm."""
        return str(self.linear.input_labels[-1])

    @property
    def disturbances(self) -> int:
        """Number of disturbances w."""
        return int(self.linear.ninputs) - 1

    @property
    def performance(self) -> int:
        """Number of performance outputs z."""
        return int(self.linear.noutputs) - len(self.sensors)

    @property
    def A(self) -> Array:
        """State matrix."""
        return np.asarray(self.linear.A)

    @property
    def B1(self) -> Array:
        """Disturbances to states."""
        return np.asarray(self.linear.B[:, :-1])

    @property
    def B2(self) -> Array:
        """Actuator to states."""
        return np.asarray(self.linear.B[:, -1:])

    @property
    def C1(self) -> Array:
        """States to performance outputs."""
        return np.asarray(self.linear.C[: self.performance])

    @property
    def C2(self) -> Array:
        """States to measurements."""
        return np.asarray(self.linear.C[self.performance :])

    @property
    def D11(self) -> Array:
        """Disturbances to performance outputs."""
        return np.asarray(self.linear.D[: self.performance, :-1])

    @property
    def D12(self) -> Array:
        """Actuator to performance outputs."""
        return np.asarray(self.linear.D[: self.performance, -1:])

    @property
    def D21(self) -> Array:
        """Disturbances to measurements."""
        return np.asarray(self.linear.D[self.performance :, :-1])

    @property
    def D22(self) -> Array:
        """Actuator to measurements."""
        return np.asarray(self.linear.D[self.performance :, -1:])

    @property
    def control_path(self) -> control.StateSpace:
        """The plant from the actuator to the measurements, as a named system."""
        return self.path.to_control()

    @cached_property
    def path(self) -> LinearSystem:
        """The same without python-control; always one object, whose modes are found once."""
        return LinearSystem(
            self.A,
            self.B2,
            self.C2,
            self.D22,
            self.linear.dt,
            inputs=[self.actuator],
            outputs=list(self.sensors),
            states=list(self.linear.state_labels),
            name=f"{self.linear.name}_control_path",
        )

    def transformed(self, T: Array) -> GeneralisedPlant:
        """Return the same plant with states T x.

        Parameters
        ----------
        T : ndarray, shape (n, n)
            Invertible.

        Raises
        ------
        InputError
            If T is of another shape, not finite or singular.
        """
        matrix, system = np.asarray(T, dtype=float), self.linear
        n = len(self.A)
        refusal = InputError(
            "the transformation is not an invertible matrix of the plant's size",
            where="transformed",
            remedy=f"give {n} by {n} finite numbers of full rank",
        )
        if matrix.shape != (n, n) or not np.isfinite(matrix).all():
            raise refusal
        try:
            inverse = np.linalg.inv(matrix)
        except np.linalg.LinAlgError as error:
            raise refusal from error
        turned = LinearSystem(
            matrix @ system.A @ inverse,
            matrix @ system.B,
            system.C @ inverse,
            system.D,
            system.dt,
            inputs=system.input_labels,
            outputs=system.output_labels,
            name=f"{system.name}_transformed",
        )
        return replace(self, system=turned)

    def close(self, controller: Any) -> Any:
        """Return the closed loop from w to z (the lower linear fractional transformation).

        Parameters
        ----------
        controller : control.StateSpace
            From the sensors to the actuator, connected with a plus sign, on the plant's clock.

        Raises
        ------
        InputError
            If the controller takes other signals than the plant's sensors, commands another
            actuator, or makes a loop without delay that has no solution (I − D_k D₂₂ singular).
        """
        return alike(controller, self.closed(controller))

    def closed(self, controller: object) -> LinearSystem:
        """Return what `close` returns, without python-control."""
        fitting = self.fitting(controller, self.sample_time or None)
        try:
            loop = lft(self.linear, fitting)
        except AlgebraicLoopError as error:
            raise ill_posed() from error
        return loop.named(name=f"{self.linear.name}_closed")

    def fitting(self, controller: object, sample_time: float | None = None) -> LinearSystem:
        """Return a controller; refuse one that does not fit the plant or has another clock.

        Parameters
        ----------
        controller : control.StateSpace
        sample_time : float, optional
            In s; without it the controller must be continuous.

        Raises
        ------
        InputError
            As `close`.
        """
        clock = "continuous-time" if sample_time is None else f"{sample_time:g} s sampled"
        system = linear(controller)
        if system is None or system.sample_time != (sample_time or 0.0):
            raise InputError(
                f"{shown(controller)} is not a {clock} StateSpace",
                where="close",
                remedy="give one with the plant's sensors as named inputs",
            )
        if system.noutputs != 1:
            raise InputError(
                f"the controller has {system.noutputs} outputs",
                where="close",
                remedy=f"give it one, the {self.actuator}",
            )
        if system.output_labels[0] != self.actuator:
            raise InputError(
                f"the controller commands {system.output_labels[0]!r} but the plant takes "
                f"{self.actuator!r}",
                where="close",
                remedy=f"name its output {self.actuator!r}, if that is what it commands",
            )
        if system.input_labels != self.sensors:
            raise InputError(
                f"the controller takes {list(system.input_labels)} but the plant measures "
                f"{list(self.sensors)}",
                where="close",
                remedy="measure the same signals in the same order",
            )
        return system


def ill_posed() -> InputError:
    """Return the error of a loop without delay whose gain is exactly one.

    Returns
    -------
    InputError

    Examples
    --------
    >>> from slewctl.plant import ill_posed
    >>> type(ill_posed()).__name__
    'InputError'
    """
    return InputError(
        "plant and controller make a loop without delay whose gain is one: it has no solution",
        where="close",
        remedy="leave out the feedthrough of one of them",
    )


def _check_system(system: object, found: LinearSystem | None) -> None:
    if clock_unknown(system):
        raise InputError(
            "the system's sample time is not known",
            where="system",
            remedy="give dt in s, or a continuous system",
        )
    if found is None:
        raise InputError(
            f"{shown(system)} is not a StateSpace",
            where="system",
            remedy="give a control.StateSpace from [w, u] to [z, y]",
        )
    if not found.finite:
        raise InputError(
            "the plant's matrices are not finite",
            where="system",
            remedy="check its numbers: a limit or a noise may be too small",
        )


def check_plant(plant: object, where: str, *, sampled: bool = False) -> None:
    """Refuse what is not a `GeneralisedPlant`, and a sampled one unless that is allowed.

    Parameters
    ----------
    plant : object
    where : str
        For the message: what was asked of it.
    sampled : bool
        Whether a plant with a sample time is allowed.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> from slewctl.plant import check_plant
    >>> check_plant(plant, "design")
    """
    if isinstance(plant, GeneralisedPlant) and plant.sample_time and not sampled:
        raise InputError(
            f"the plant is sampled, every {plant.sample_time:g} s, and this method takes "
            "continuous plants",
            where=where,
            remedy="give the continuous plant, or use lqg, which takes both",
        )
    if not isinstance(plant, GeneralisedPlant):
        raise InputError(
            f"{shown(plant)} is not a GeneralisedPlant",
            where=where,
            remedy="make one with slewctl.generalised_plant(model, objective)",
        )
