"""The parts of a loop as a user has them: state spaces, their signals, and the sign between.

One place for what all functions of a plant and a controller agree on.  Signals are matched by
name where both sides have names of their own, and by position only where one has none.  The
sign is that of `control.feedback`: −1 unless told otherwise, +1 with a `Controller`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from slewctl.design import Controller
from slewctl.errors import InputError, shown
from slewctl.numerics.frequency_response import sample_time
from slewctl.numerics.given_system import read_system, static
from slewctl.numerics.linear_system import LinearSystem, nameless
from slewctl.plant import GeneralisedPlant

if TYPE_CHECKING:
    import control

System: TypeAlias = "LinearSystem | control.StateSpace | control.TransferFunction"
Plant: TypeAlias = "GeneralisedPlant | System"


def state_space(system: object, where: str) -> LinearSystem:
    """Return a system as a state space; of a generalised plant the actuator's path."""
    return system.path if isinstance(system, GeneralisedPlant) else read_system(system, where)


def feedback_sign(sign: object, controller: object = None) -> int:
    """Return −1 or +1: what was given, or what belongs to the controller.

    Raises
    ------
    InputError
        For another value, or one that contradicts a slewctl `Controller`.
    """
    own = 1 if isinstance(controller, Controller) else -1
    if sign is None:
        return own
    if not isinstance(sign, Real) or isinstance(sign, bool) or sign not in (-1, 1):
        raise InputError(
            f"{shown(sign)} is no sign",
            where="sign",
            remedy="give -1 for negative feedback, as in control.feedback, or +1",
        )
    if isinstance(controller, Controller) and sign != own:
        raise InputError(
            "a slewctl Controller has its minus inside and is connected with a plus sign",
            where="sign",
            remedy="leave the sign out, or give the controller's system with a sign of your own",
        )
    return -1 if sign == -1 else 1


def negated(system: LinearSystem) -> LinearSystem:
    """Return −G with the names of G."""
    return times(-1.0, system)


def times(factor: float, system: LinearSystem) -> LinearSystem:
    """Return a factor times G with the names of G."""
    return LinearSystem(
        system.A,
        system.B,
        factor * np.asarray(system.C),
        factor * np.asarray(system.D),
        system.dt,
        inputs=list(system.input_labels),
        outputs=list(system.output_labels),
    )


def arranged(
    system: LinearSystem, inputs: Sequence[str], outputs: Sequence[str], where: str
) -> LinearSystem:
    """Return a system with its signals in the order of those that they meet.

    Parameters
    ----------
    system : LinearSystem
    inputs, outputs : sequence of str
        Names on the other side of the connection, as many as the system has.
    where : str
        What the system is called in messages.

    Raises
    ------
    InputError
        If both sides have names of their own, and one side has one that the other lacks.
    """
    columns = order(system.input_labels, inputs, f"{where}: inputs")
    rows = order(system.output_labels, outputs, f"{where}: outputs")
    return LinearSystem(
        system.A,
        system.B[:, columns],
        system.C[rows],
        system.D[np.ix_(rows, columns)],
        system.dt,
        inputs=list(inputs),
        outputs=list(outputs),
    )


def order(names: Sequence[str], wanted: Sequence[str], where: str) -> list[int]:
    """Return where each wanted name stands among `names`; see `arranged`."""
    if any(nameless(side) for side in (names, wanted)):
        return list(range(len(wanted)))
    if sorted(names) != sorted(wanted):
        raise InputError(
            f"they are called {', '.join(names)}; what they meet is called {', '.join(wanted)}",
            where=where,
            remedy="call the same signal by the same name; without names, [u[0], …] and "
            "[y[0], …], signals are matched by position",
        )
    return [list(names).index(name) for name in wanted]


@dataclass(frozen=True, eq=False)
class Pair:
    """A plant and its controller, the controller's signals in the plant's order.

    Attributes
    ----------
    plant, controller : LinearSystem
        G and K.
    sign : int
        u = sign·K y.
    """

    plant: LinearSystem
    controller: LinearSystem
    sign: int

    @property
    def negative(self) -> LinearSystem:
        """K for negative feedback, u = −K y."""
        return self.controller if self.sign < 0 else negated(self.controller)

    @property
    def positive(self) -> LinearSystem:
        """K for connection with a plus sign, u = K y."""
        return self.controller if self.sign > 0 else negated(self.controller)

    @property
    def clocks(self) -> tuple[float, float]:
        """Sample times of plant and controller in s, zero if continuous."""
        return sample_time(self.plant), sample_time(self.controller)

    def on_one_clock(self) -> Pair:
        """Return the same pair; refuse unlike sample times."""
        own, other = self.clocks
        if own != other:
            raise InputError(
                f"the plant has sample time {own:g} s, the controller {other:g} s",
                where="controller",
                remedy="sample both alike",
            )
        return self


def paired(
    plant: Plant,
    controller: Controller | System | float,
    sign: int | None = None,
) -> Pair:
    """Return plant and controller as they are connected.

    Parameters
    ----------
    plant : GeneralisedPlant, control.StateSpace or control.TransferFunction
    controller : Controller, control.StateSpace, control.TransferFunction or float
    sign : int, optional
        See `feedback_sign`.

    Raises
    ------
    InputError
        If their signals do not fit together, or the sign is impossible.
    """
    G, direction = state_space(plant, "plant"), feedback_sign(sign, controller)
    if isinstance(controller, Controller):
        controller = controller.linear
    if isinstance(controller, Real) and not isinstance(controller, bool):
        controller = static(float(controller), G.dt)
    K = state_space(controller, "controller")
    if (K.ninputs, K.noutputs) != (G.noutputs, G.ninputs):
        raise InputError(
            f"it takes {K.ninputs} and commands {K.noutputs} signals, the plant gives "
            f"{G.noutputs} and takes {G.ninputs}: it does not fit",
            where="controller",
            remedy="let it read all outputs and command all inputs of the plant",
        )
    return Pair(G, arranged(K, G.output_labels, G.input_labels, "controller"), direction)
