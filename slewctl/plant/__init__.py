"""State-space models with named signals, and the generalised plant w, u → z, y."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.plant.arm_problem import arm_signals, generalised_plant
    from slewctl.plant.dead_time import loop_dead_time
    from slewctl.plant.encoder import encoder_noise
    from slewctl.plant.nonlinear import nonlinear_system
    from slewctl.plant.objective import Objective, signals_alone
    from slewctl.plant.problem import GeneralisedPlant, check_plant, ill_posed
    from slewctl.plant.reduced import Reduced
    from slewctl.plant.reduction import balanced_truncation, modal_truncation
    from slewctl.plant.sampled import (
        SampledClosed,
        SampledPlant,
        continuous_equivalent,
        sampled_plant,
        split_delay,
    )
    from slewctl.plant.signals import ACTUATORS, SIGNALS, TORQUE, VOLTAGE, Signal, signal
    from slewctl.plant.statespace import state_space

__all__ = [
    "ACTUATORS",
    "SIGNALS",
    "TORQUE",
    "VOLTAGE",
    "GeneralisedPlant",
    "Objective",
    "Reduced",
    "SampledClosed",
    "SampledPlant",
    "Signal",
    "arm_signals",
    "balanced_truncation",
    "check_plant",
    "continuous_equivalent",
    "encoder_noise",
    "generalised_plant",
    "ill_posed",
    "loop_dead_time",
    "modal_truncation",
    "nonlinear_system",
    "sampled_plant",
    "signal",
    "signals_alone",
    "split_delay",
    "state_space",
]

__getattr__, __dir__ = attach(__name__, __file__)
