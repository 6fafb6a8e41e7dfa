"""Control design for slewing flexible arms.

Describe an arm, get python-control models of it in several assumed-mode bases, design on a
small one, and judge every controller on a converged model of the same arm::

    Arm → assemble(arm, basis) → generalised_plant(model, objective) → lqg(plant)
        → close(truth(arm), objective, controller) → loop.stable, loop.margins, loop.h2
"""

from slewctl.arm import Arm, Beam, Hub, Payload, Stations
from slewctl.arm import catalogue as arms
from slewctl.basis import ClampedFree, Polynomial, Slewing
from slewctl.design import Controller, kalman, lqg, lqr
from slewctl.errors import AccuracyError, DesignError, InputError, SlewctlError
from slewctl.loop import Loop, Margins, Slew, UnstableLoopError, close, simulate_slew
from slewctl.model import Model, Truth, assemble, truth
from slewctl.plant import GeneralisedPlant, Objective, generalised_plant, state_space

__version__ = "0.1.0"

__all__ = [
    "AccuracyError",
    "Arm",
    "Beam",
    "ClampedFree",
    "Controller",
    "DesignError",
    "GeneralisedPlant",
    "Hub",
    "InputError",
    "Loop",
    "Margins",
    "Model",
    "Objective",
    "Payload",
    "Polynomial",
    "Slew",
    "SlewctlError",
    "Slewing",
    "Stations",
    "Truth",
    "UnstableLoopError",
    "arms",
    "assemble",
    "close",
    "generalised_plant",
    "kalman",
    "lqg",
    "lqr",
    "simulate_slew",
    "state_space",
    "truth",
]
