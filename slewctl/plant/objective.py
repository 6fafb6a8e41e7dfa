"""What a controller is asked to do: what is kept small, what disturbs, what is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from slewctl.errors import InputError, check_choice, check_positive, shown
from slewctl.plant.signals import ACTUATORS, SIGNALS, TORQUE, check_signals
from slewctl.plant.statespace import Actuator


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
        Square root of the two-sided spectral density of the torque disturbance (N·m/√Hz),
        which acts where the actuator's torque does, on the hub or on the rotor behind an
        elastic joint, and of each sensor's noise (its unit/√Hz).  The
        sensors named here are the measurements.
    weighted : bool
        False where limits and noise only name the signals; see `signals_alone`.

    Raises
    ------
    InputError
        For an unknown signal, a value that is not positive, when the torque or every
        sensor is missing, or when the limits name both actuators.

    Examples
    --------
    >>> import slewctl as sc
    >>> objective = sc.Objective({"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> objective.actuator, objective.sensors
    ('torque', ('theta',))
    """

    limits: Mapping[str, float]
    noise: Mapping[str, float]
    # False where they only name the signals: then nothing that is weighted by them has a meaning.
    weighted: bool = True

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


def signals_alone(sensors: Sequence[str], actuator: str) -> Objective:
    """Return an objective that says what is measured and commanded, and weighs nothing.

    Parameters
    ----------
    sensors : sequence of str
        What is measured.
    actuator : {"torque", "voltage"}

    Returns
    -------
    Objective

    Examples
    --------
    >>> signals_alone(["theta"], "torque").weighted
    False
    """
    limits = {"tip": 1.0, actuator: 1.0}
    return Objective(limits, {TORQUE: 1.0, **dict.fromkeys(sensors, 1.0)}, weighted=False)


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
