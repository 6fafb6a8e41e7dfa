"""Controller design, one file per method, with one result type."""

from collections.abc import Callable

from slewctl.design.h2 import build_h2, h2_lmi, solve_h2
from slewctl.design.lqg import lqg
from slewctl.design.lqr import kalman, lqr
from slewctl.design.result import Certificate, Check, Controller, given
from slewctl.plant import GeneralisedPlant

METHODS: dict[str, Callable[[GeneralisedPlant], Controller]] = {
    "lqg": lqg,
    "h2-lmi": h2_lmi,
}

__all__ = [
    "METHODS",
    "Certificate",
    "Check",
    "Controller",
    "build_h2",
    "given",
    "h2_lmi",
    "kalman",
    "lqg",
    "lqr",
    "solve_h2",
]
