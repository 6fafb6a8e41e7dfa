"""Matrices without names or an arm, in coordinates in which their poles can be placed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.errors import InputError
from slewctl.numerics.balance import balance_system


def exactly(given: tuple[Any, ...], what: str) -> tuple[Any, ...]:
    """Refuse more or fewer arguments than are meant."""
    wanted = what.count(" and ") + 1
    if len(given) != wanted:
        raise InputError(
            f"{len(given)} arguments after the first",
            where="place",
            remedy=f"give {what} after it: place(plant, poles), or place(A, B, poles)",
        )
    return given


@dataclass(frozen=True, eq=False)
class Balanced:
    """Matrices in balanced coordinates, where a scaled plant could stand."""

    A: Array
    B2: Array
    scale: Array
    rate: float = 1.0

    @classmethod
    def of(cls, A: Array, B: Array) -> Balanced:
        if A.shape != (len(A), len(A)) or len(B) != len(A):
            raise InputError(
                f"A has shape {A.shape}, B {B.shape}",
                where="place",
                remedy="give a square A, and B with as many rows",
            )
        scale = balance_system(A, B, np.zeros((0, len(A))))
        return cls(A / scale[:, None] * scale, B / scale[:, None], scale)

    def state_feedback(self, gain: Array) -> Array:
        """Return a gain in the coordinates given."""
        return gain / self.scale
