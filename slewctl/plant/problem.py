"""The generalised plant w, u → z, y that H2 methods design on, and the loop around it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import control
import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, shown
from slewctl.model import Model
from slewctl.plant.objective import Objective


@dataclass(frozen=True, eq=False)
class GeneralisedPlant:
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

    Raises
    ------
    InputError
        If the system is of another kind, not finite, or without states, w, z or y.
    """

    system: control.StateSpace
    sensors: tuple[str, ...]
    model: Model | None = None
    objective: Objective | None = None

    def __post_init__(self) -> None:
        _check_system(self.system)
        sensors = (self.sensors,) if isinstance(self.sensors, str) else tuple(self.sensors)
        outputs = list(self.system.output_labels)
        if not sensors or outputs[-len(sensors) :] != list(sensors):
            raise InputError(
                f"the sensors {list(sensors)} are not the last outputs of {outputs}",
                where="sensors",
                remedy="order the outputs z first, then y, and name the sensors in that order",
            )
        object.__setattr__(self, "sensors", sensors)
        if not self.system.nstates or self.disturbances < 1 or self.performance < 1:
            raise InputError(
                "the plant has no states, no disturbance or no performance output",
                where="system",
                remedy="give at least one of each: inputs w then the actuator, outputs z then "
                "the sensors",
            )

    @property
    def sample_time(self) -> float:
        """T in s of a sampled plant; zero for a continuous one."""
        return float(self.system.dt or 0.0)

    @property
    def actuator(self) -> str:
        """Name of the control input; ``torque`` or ``voltage`` for an arm."""
        return str(self.system.input_labels[-1])

    @property
    def disturbances(self) -> int:
        """Number of disturbances w."""
        return int(self.system.ninputs) - 1

    @property
    def performance(self) -> int:
        """Number of performance outputs z."""
        return int(self.system.noutputs) - len(self.sensors)

    @property
    def A(self) -> Array:
        """State matrix."""
        return np.asarray(self.system.A)

    @property
    def B1(self) -> Array:
        """Disturbances to states."""
        return np.asarray(self.system.B[:, :-1])

    @property
    def B2(self) -> Array:
        """Actuator to states."""
        return np.asarray(self.system.B[:, -1:])

    @property
    def C1(self) -> Array:
        """States to performance outputs."""
        return np.asarray(self.system.C[: self.performance])

    @property
    def C2(self) -> Array:
        """States to measurements."""
        return np.asarray(self.system.C[self.performance :])

    @property
    def D11(self) -> Array:
        """Disturbances to performance outputs."""
        return np.asarray(self.system.D[: self.performance, :-1])

    @property
    def D12(self) -> Array:
        """Actuator to performance outputs."""
        return np.asarray(self.system.D[: self.performance, -1:])

    @property
    def D21(self) -> Array:
        """Disturbances to measurements."""
        return np.asarray(self.system.D[self.performance :, :-1])

    @property
    def D22(self) -> Array:
        """Actuator to measurements."""
        return np.asarray(self.system.D[self.performance :, -1:])

    @property
    def control_path(self) -> control.StateSpace:
        """The plant from the actuator to the measurements, as a named system."""
        return control.StateSpace(
            self.A,
            self.B2,
            self.C2,
            self.D22,
            self.system.dt,
            inputs=[self.actuator],
            outputs=list(self.sensors),
            states=list(self.system.state_labels),
            name=f"{self.system.name}_control_path",
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
        matrix, system = np.asarray(T, dtype=float), self.system
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
        turned = control.StateSpace(
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

    def close(self, controller: control.StateSpace) -> control.StateSpace:
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
        self.check_controller(controller, self.sample_time or None)
        Ak, Bk, Ck, Dk = (
            np.asarray(m) for m in (controller.A, controller.B, controller.C, controller.D)
        )
        n, k, w = len(self.A), len(Ak), self.disturbances
        # u = Dk (C₂ x + D₂₁ w + D₂₂ u) + Ck x_k, solved for u.
        left = np.eye(1) - Dk @ self.D22
        if abs(left[0, 0]) <= 4 * np.finfo(float).eps * (1 + abs(left[0, 0] - 1)):
            raise ill_posed()
        u = np.linalg.solve(left, np.hstack([Dk @ self.C2, Ck, Dk @ self.D21]))
        x = np.hstack([self.A, np.zeros((n, k)), self.B1]) + self.B2 @ u
        z = np.hstack([self.C1, np.zeros((self.performance, k)), self.D11]) + self.D12 @ u
        y = np.hstack([self.C2, np.zeros((len(self.sensors), k)), self.D21]) + self.D22 @ u
        x_k = np.hstack([np.zeros((k, n)), Ak, np.zeros((k, w))]) + Bk @ y
        moved = np.vstack([x, x_k])
        return control.StateSpace(
            moved[:, : n + k],
            moved[:, n + k :],
            z[:, : n + k],
            z[:, n + k :],
            self.system.dt,
            inputs=list(self.system.input_labels[:-1]),
            outputs=list(self.system.output_labels[: self.performance]),
            name=f"{self.system.name}_closed",
        )

    def check_controller(
        self, controller: control.StateSpace, sample_time: float | None = None
    ) -> None:
        """Refuse a controller that does not fit the plant, or runs on another clock.

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
        known = isinstance(controller, control.StateSpace)
        if not known or not _runs_on(controller, sample_time):
            raise InputError(
                f"{shown(controller)} is not a {clock} StateSpace",
                where="close",
                remedy="give one with the plant's sensors as named inputs",
            )
        if controller.noutputs != 1:
            raise InputError(
                f"the controller has {controller.noutputs} outputs",
                where="close",
                remedy=f"give it one, the {self.actuator}",
            )
        if controller.output_labels[0] != self.actuator:
            raise InputError(
                f"the controller commands {controller.output_labels[0]!r} but the plant takes "
                f"{self.actuator!r}",
                where="close",
                remedy=f"name its output {self.actuator!r}, if that is what it commands",
            )
        if tuple(controller.input_labels) != self.sensors:
            raise InputError(
                f"the controller takes {controller.input_labels} but the plant measures "
                f"{list(self.sensors)}",
                where="close",
                remedy="measure the same signals in the same order",
            )


def _runs_on(controller: control.StateSpace, sample_time: float | None) -> bool:
    if sample_time is None:
        return bool(controller.isctime())
    return bool(controller.isdtime(strict=True)) and float(controller.dt) == sample_time


def ill_posed() -> InputError:
    """Return the error of a loop without delay whose gain is exactly one."""
    return InputError(
        "plant and controller make a loop without delay whose gain is one: it has no solution",
        where="close",
        remedy="leave out the feedthrough of one of them",
    )


def _check_system(system: object) -> None:
    if not isinstance(system, control.StateSpace):
        raise InputError(
            f"{shown(system)} is not a StateSpace",
            where="system",
            remedy="give a control.StateSpace from [w, u] to [z, y]",
        )
    if system.dt is True:
        raise InputError(
            "the system's sample time is not known",
            where="system",
            remedy="give dt in s, or a continuous system",
        )
    if not all(np.isfinite(getattr(system, name)).all() for name in "ABCD"):
        raise InputError(
            "the plant's matrices are not finite",
            where="system",
            remedy="check its numbers: a limit or a noise may be too small",
        )


def check_plant(plant: object, where: str, *, sampled: bool = False) -> None:
    """Refuse what is not a `GeneralisedPlant`, and a sampled one unless that is allowed."""
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
