"""Control design for slewing flexible arms.

Describe an arm, get python-control models of it in several assumed-mode bases, design on a
small one, and judge every controller on a converged model of the same arm::

    Arm → assemble(arm, basis) → generalised_plant(model, objective) → lqg(plant)
        → close(truth(arm), objective, controller) → loop.stable, loop.margins, loop.h2
"""

from slewctl.arm import (
    Arm,
    Beam,
    Hub,
    KelvinVoigt,
    Motor,
    Payload,
    Rayleigh,
    Stations,
)
from slewctl.arm import catalogue as arms
from slewctl.basis import ArmMatched, ClampedFree, HubMatched, Polynomial, Slewing, WithStatic
from slewctl.design import Controller, h2_lmi, kalman, lqg, lqr
from slewctl.errors import AccuracyError, DesignError, InputError, SlewctlError
from slewctl.loop import (
    Loop,
    Margins,
    Slew,
    Swing,
    UnstableLoopError,
    close,
    simulate_slew,
    simulate_swing,
)
from slewctl.model import (
    Fit,
    Model,
    NonlinearModel,
    Truth,
    arm_modes,
    assemble,
    fit,
    hub_locked_frequencies_hz,
    large_slew,
    spin_frequencies_hz,
    truth,
)
from slewctl.plant import (
    GeneralisedPlant,
    Objective,
    generalised_plant,
    nonlinear_system,
    state_space,
)

__version__ = "0.1.0"

__all__ = [
    "AccuracyError",
    "Arm",
    "ArmMatched",
    "Beam",
    "ClampedFree",
    "Controller",
    "DesignError",
    "Fit",
    "GeneralisedPlant",
    "Hub",
    "HubMatched",
    "InputError",
    "KelvinVoigt",
    "Loop",
    "Margins",
    "Model",
    "Motor",
    "NonlinearModel",
    "Objective",
    "Payload",
    "Polynomial",
    "Rayleigh",
    "Slew",
    "SlewctlError",
    "Slewing",
    "Stations",
    "Swing",
    "Truth",
    "UnstableLoopError",
    "WithStatic",
    "arm_modes",
    "arms",
    "assemble",
    "close",
    "fit",
    "generalised_plant",
    "h2_lmi",
    "hub_locked_frequencies_hz",
    "kalman",
    "large_slew",
    "lqg",
    "lqr",
    "nonlinear_system",
    "simulate_slew",
    "simulate_swing",
    "spin_frequencies_hz",
    "state_space",
    "truth",
]
