"""The box of an arm's properties in which the worst arm is sought."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from inspect import Parameter, signature

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm, vary
from slewctl.errors import InputError, check_number, shown, suggest

# The properties that can be uncertain: what `vary` changes.
PROPERTIES = tuple(
    name for name, p in signature(vary).parameters.items() if p.kind is Parameter.KEYWORD_ONLY
)
# Every corner is tried: 2⁸ arms.
_MOST_PROPERTIES = 8


def box_bounds(box: Mapping[str, Sequence[float]], arm: Arm) -> tuple[Array, Array]:
    """Return the lowest and highest value of each property, having tried both on the arm."""
    if not isinstance(box, Mapping) or not 1 <= len(box) <= _MOST_PROPERTIES:
        raise InputError(
            f"{shown(box)} is not a box of 1 to {_MOST_PROPERTIES} properties",
            where="box",
            remedy="give one, such as stiffness_factor from 0.9 to 1.1",
        )
    for name, interval in box.items():
        if name not in PROPERTIES:
            raise InputError(
                f"unknown property {shown(name)}",
                where=f"box.{name}",
                remedy=suggest(str(name), PROPERTIES),
            )
        if isinstance(interval, str) or not isinstance(interval, Sequence) or len(interval) != 2:
            raise InputError(
                f"{shown(interval)} is not a range",
                where=f"box.{name}",
                remedy="give the lowest and the highest value",
            )
        if not check_number(interval[0], f"box.{name}") < check_number(interval[1], f"box.{name}"):
            raise InputError(
                f"{interval[0]:g} … {interval[1]:g} is empty",
                where=f"box.{name}",
                remedy="put the lowest value first and a greater one after it",
            )
        for end in interval:
            try:
                vary(arm, **{name: float(end)})
            except InputError as error:
                raise error.at(f"box.{name}") from error
    for side in (0, 1):
        try:
            vary(arm, **{name: float(interval[side]) for name, interval in box.items()})
        except InputError as error:
            raise error.within("box", ".") from error
    low, high = np.array([[float(end) for end in interval] for interval in box.values()]).T
    return low, high
