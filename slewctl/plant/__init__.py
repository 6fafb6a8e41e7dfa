"""State-space models with named signals, and the generalised plant w, u → z, y."""

from slewctl.plant.nonlinear import nonlinear_system
from slewctl.plant.problem import GeneralisedPlant, Objective, check_plant, generalised_plant
from slewctl.plant.signals import ACTUATORS, SIGNALS, TORQUE, VOLTAGE, Signal, signal
from slewctl.plant.statespace import state_space

__all__ = [
    "ACTUATORS",
    "SIGNALS",
    "TORQUE",
    "VOLTAGE",
    "GeneralisedPlant",
    "Objective",
    "Signal",
    "check_plant",
    "generalised_plant",
    "nonlinear_system",
    "signal",
    "state_space",
]
