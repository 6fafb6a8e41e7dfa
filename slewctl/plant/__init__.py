"""State-space models with named signals, and the generalised plant w, u → z, y."""

from slewctl.plant.problem import GeneralisedPlant, Objective, generalised_plant
from slewctl.plant.signals import SIGNALS, TORQUE
from slewctl.plant.statespace import state_space

__all__ = ["SIGNALS", "TORQUE", "GeneralisedPlant", "Objective", "generalised_plant", "state_space"]
