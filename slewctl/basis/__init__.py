"""Admissible functions, one file per basis, behind one narrow contract."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.basis.arm_matched import ArmMatched
    from slewctl.basis.clamped_free import ClampedFree
    from slewctl.basis.combined import Combined
    from slewctl.basis.contract import Basis, Growth
    from slewctl.basis.hub_matched import HubMatched
    from slewctl.basis.matched_roots import Ratios
    from slewctl.basis.modal import MODAL, Modal, modal_rows
    from slewctl.basis.named import BASES, NAMES, bases_of, create
    from slewctl.basis.polynomial import Polynomial
    from slewctl.basis.slewing import Slewing
    from slewctl.basis.with_static import WithStatic

__all__ = [
    "BASES",
    "MODAL",
    "NAMES",
    "ArmMatched",
    "Basis",
    "ClampedFree",
    "Combined",
    "Growth",
    "HubMatched",
    "Modal",
    "Polynomial",
    "Ratios",
    "Slewing",
    "WithStatic",
    "bases_of",
    "create",
    "modal_rows",
]

__getattr__, __dir__ = attach(__name__, __file__)
