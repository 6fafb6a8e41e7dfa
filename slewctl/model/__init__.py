"""Models of an arm: quadrature, assembly of M, D, K and b, and the truth."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.model.assembly import Model, assemble
    from slewctl.model.converged_truth import Truth, arm_modes, truth
    from slewctl.model.data_of_beam import modal_data
    from slewctl.model.large_deflection import LargeDeflectionError
    from slewctl.model.locked import BOUNDARIES, Frequencies, frequencies, hub_locked_frequencies_hz
    from slewctl.model.nonlinear import NonlinearModel, large_slew
    from slewctl.model.rigid import beam_inertia, beam_mass, total_inertia
    from slewctl.model.spin import SpinSofteningWarning, critical_spin_rad_s, spin_frequencies_hz

__all__ = [
    "BOUNDARIES",
    "Frequencies",
    "LargeDeflectionError",
    "Model",
    "NonlinearModel",
    "SpinSofteningWarning",
    "Truth",
    "arm_modes",
    "assemble",
    "beam_inertia",
    "beam_mass",
    "critical_spin_rad_s",
    "frequencies",
    "hub_locked_frequencies_hz",
    "large_slew",
    "modal_data",
    "spin_frequencies_hz",
    "total_inertia",
    "truth",
]

__getattr__, __dir__ = attach(__name__, __file__)
