"""The generalised plant of a disturbance-rejection problem on an arm.

                 ┌───────────────────┐
    w_torque ───►│                   ├───► z_<output>   = output / largest acceptable value
    w_<sensor> ─►│         P         ├───► z_<actuator> = actuator / largest acceptable value
                 │                   │
    <actuator> ─►│                   ├───► <sensor>     = measurement + noise
                 └───────────────────┘

The actuator is the ``torque`` on the hub or the ``voltage`` of the motor.  The
disturbances w are independent white noises of unit intensity; the controller feeds the
sensors back to the actuator so that the H2 norm from w to z is small.  Its square is the
stationary mean of Σ z².
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import control
import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError, check_choice, check_positive, shown
from slewctl.model import Model
from slewctl.model.assembly import check_model
from slewctl.plant.signals import ACTUATORS, SIGNALS, TORQUE, check_signals
from slewctl.plant.statespace import Actuator, Coordinates, drive, state_space


@dataclass(frozen=True)
class Objective:
    """What a controller is asked to do, in physical terms.

    Parameters
    ----------
    limits : mapping of str to float
        Largest acceptable value of outputs and of the actuator (Bryson's rule): each enters
        the cost divided by it.  Exactly one of ``torque`` (N·m) and ``voltage`` (V) is
        required: the one that the controller commands.
    noise : mapping of str to float
        Square root of the two-sided spectral density of the torque disturbance on the hub
        (N·m/√Hz), whatever the actuator, and of each sensor's noise (its unit/√Hz).  The
        sensors named here are the measurements.

    Raises
    ------
    InputError
        For an unknown signal, a value that is not positive, when the torque or every
        sensor is missing, or when the limits name both actuators.
    """

    limits: Mapping[str, float]
    noise: Mapping[str, float]

    def __post_init__(self) -> None:
        for name in ("limits", "noise"):
            given: Mapping[str, float] = getattr(self, name)
            if not isinstance(given, Mapping):
                raise InputError(
                    f"{shown(given)} is not a mapping",
                    where=name,
                    remedy="give one, as in {'tip': 0.1, 'torque': 1.0}",
                )
            numbers = {key: check_positive(v, f"{name}.{key}") for key, v in given.items()}
            inputs = ACTUATORS if name == "limits" else (TORQUE,)
            outputs = [key for key in numbers if key not in inputs]
            for key in outputs:
                if "@" not in key:
                    check_choice(key, (*SIGNALS, *inputs), name)
            _check_inputs([key for key in numbers if key in inputs], name)
            if not outputs:
                use = "kept small" if name == "limits" else "measured"
                raise InputError(
                    f"no output is {use}", where=name, remedy=f"add one, such as {name}.theta"
                )
            check_signals(outputs, name)
            object.__setattr__(self, name, numbers)

    @property
    def actuator(self) -> Actuator:
        """What the controller commands: the torque on the hub or the motor's voltage."""
        return "torque" if TORQUE in self.limits else "voltage"

    @property
    def performance(self) -> tuple[str, ...]:
        """The outputs that are kept small."""
        return tuple(name for name in self.limits if name not in ACTUATORS)

    @property
    def sensors(self) -> tuple[str, ...]:
        """The outputs that are measured."""
        return tuple(name for name in self.noise if name != TORQUE)


def _check_inputs(named: Sequence[str], where: str) -> None:
    """Refuse limits or noise without a value for the input, or with one for two."""
    if not named:
        instead = f", or {where}.voltage for an arm with a motor" if where == "limits" else ""
        raise InputError(
            "no value for torque",
            where=where,
            remedy=f"add {where}.torque{instead}: without it the problem has no unique solution",
        )
    if len(named) > 1:
        raise InputError(
            f"values for both {' and '.join(named)}",
            where=where,
            remedy="keep the one that the controller commands",
        )


@dataclass(frozen=True, eq=False)
class GeneralisedPlant:
    """A plant with named disturbances, controls, performance outputs and measurements.

    Attributes
    ----------
    system : control.StateSpace
        Inputs ``w_…`` then the actuator; outputs ``z_…`` then the sensors.
    sensors : tuple of str
    model : Model or None
        What the plant was made of, for methods that need more than its matrices.
    objective : Objective or None
    """

    system: control.StateSpace
    sensors: tuple[str, ...]
    model: Model | None = None
    objective: Objective | None = None

    @property
    def actuator(self) -> str:
        """Name of the control input, ``torque`` or ``voltage``."""
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
    def D12(self) -> Array:
        """Actuator to performance outputs."""
        return np.asarray(self.system.D[: self.performance, -1:])

    @property
    def D21(self) -> Array:
        """Disturbances to measurements."""
        return np.asarray(self.system.D[self.performance :, :-1])

    @property
    def control_path(self) -> control.StateSpace:
        """The plant from the actuator to the measurements, as a named system."""
        return control.StateSpace(
            self.A,
            self.B2,
            self.C2,
            np.asarray(self.system.D[self.performance :, -1:]),
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
            From the sensors to the actuator, connected with a plus sign.

        Raises
        ------
        InputError
            If the controller takes other signals than the plant's sensors, or commands
            another actuator.
        """
        self.check_controller(controller)
        Ak, Bk, Ck, Dk = (
            np.asarray(m) for m in (controller.A, controller.B, controller.C, controller.D)
        )
        BDk = self.B2 @ Dk
        DDk = self.D12 @ Dk
        return control.StateSpace(
            np.block([[self.A + BDk @ self.C2, self.B2 @ Ck], [Bk @ self.C2, Ak]]),
            np.vstack([self.B1 + BDk @ self.D21, Bk @ self.D21]),
            np.hstack([self.C1 + DDk @ self.C2, self.D12 @ Ck]),
            DDk @ self.D21,
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


def check_plant(plant: object, where: str) -> None:
    """Refuse what is not a `GeneralisedPlant`."""
    if not isinstance(plant, GeneralisedPlant):
        raise InputError(
            f"{shown(plant)} is not a GeneralisedPlant",
            where=where,
            remedy="make one with slewctl.generalised_plant(model, objective)",
        )


def generalised_plant(
    model: Model, objective: Objective, *, coordinates: Coordinates = "modal"
) -> GeneralisedPlant:
    """Return the generalised plant of `objective` on `model`.

    Parameters
    ----------
    model : Model
    objective : Objective
    coordinates : {"modal", "physical"}
        Of the states, see `state_space`.  The modal ones are much the better conditioned;
        every design method takes both.

    Returns
    -------
    GeneralisedPlant

    Raises
    ------
    InputError
        If a performance output or sensor responds to the torque without delay (such as
        ``tip_acceleration``), for which the H2 cost is not finite; if a station is beyond
        the tip, or the objective limits the voltage of an arm without a motor.
    """
    check_model(model, "generalised_plant")
    if not isinstance(objective, Objective):
        raise InputError(
            f"{shown(objective)} is not an Objective",
            where="generalised_plant",
            remedy="give a slewctl.Objective",
        )
    z_names, sensors, actuator = objective.performance, objective.sensors, objective.actuator
    outputs = _union(z_names, sensors)
    plant = state_space(model, outputs, input=actuator, coordinates=coordinates)
    torque_per_unit = drive(model.arm, actuator)[0]
    for name, feedthrough in zip(plant.output_labels, plant.D[:, 0], strict=True):
        if feedthrough != 0:
            raise InputError(
                f"{name} responds to the torque without delay",
                where="objective",
                remedy="leave it out: white torque noise would make its variance infinite",
            )
    rows = {name: plant.C[i] for i, name in enumerate(plant.output_labels)}
    nz, ny = len(z_names) + 1, len(sensors)
    states = plant.nstates
    disturbance = objective.noise[TORQUE] * (plant.B / torque_per_unit)
    B = np.hstack([disturbance, np.zeros((states, ny)), plant.B])
    C = np.zeros((nz + ny, states))
    D = np.zeros((nz + ny, ny + 2))
    for i, name in enumerate(z_names):
        C[i] = rows[name] / objective.limits[name]
    D[nz - 1, -1] = 1 / objective.limits[actuator]
    for i, name in enumerate(sensors):
        C[nz + i] = rows[name]
        D[nz + i, 1 + i] = objective.noise[name]
    system = control.StateSpace(
        plant.A,
        B,
        C,
        D,
        inputs=["w_torque", *(f"w_{name}" for name in sensors), actuator],
        outputs=[*(f"z_{name}" for name in z_names), f"z_{actuator}", *sensors],
        states=list(plant.state_labels),
        name=f"{plant.name}_generalised",
    )
    return GeneralisedPlant(system, sensors, model, objective)


def _union(first: Sequence[str], second: Sequence[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys([*first, *second]))
