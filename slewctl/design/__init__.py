"""Controller design, one file per method, with one result type."""

from collections.abc import Callable

from slewctl.design.lqg import lqg
from slewctl.design.lqr import kalman, lqr
from slewctl.design.result import Certificate, Check, Controller
from slewctl.plant import GeneralisedPlant

METHODS: dict[str, Callable[[GeneralisedPlant], Controller]] = {"lqg": lqg}

__all__ = ["METHODS", "Certificate", "Check", "Controller", "kalman", "lqg", "lqr"]
