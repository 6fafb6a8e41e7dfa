"""What is seen at the places of an arm from modal data."""

from __future__ import annotations

from typing import Literal

import numpy as np

from slewctl._types import Array
from slewctl.arm import Beam, ModalData, Place
from slewctl.errors import InputError
from slewctl.model import Model

Seen = Literal["displacement", "deflection", "moment"]
# What the data of a place must hold for each.
_KEYS: dict[Seen, str] = {"displacement": "shapes", "deflection": "shapes", "moment": "moments"}


def place_row(model: Model, beam: ModalData, name: str, seen: Seen) -> Array:
    """Return the row of [θ, q] that is seen at a place, shape (n+1,).

    Parameters
    ----------
    model : Model
        Of an arm from modal data.
    beam : ModalData
        That arm's.
    name : str
        Of the place.
    seen : {"displacement", "deflection", "moment"}
        Along the arc, in m; relative to the turned rigid structure, in m; in N·m.
    """
    values = seen_at(beam, name, seen, "outputs")
    lever = beam.lever(name) if seen == "displacement" else 0.0
    row = lever * model.turning
    row[1:] += model.of_modes(values)
    return row


def seen_at(beam: ModalData, name: str, seen: Seen, where: str) -> Array:
    """Return what each mode shows at a place; refuse what the data do not tell."""
    place: Place = beam.place(name, where)
    values = getattr(place, _KEYS[seen])
    if values is None:
        raise InputError(
            f"the modal data tell no {_KEYS[seen]} of the place {name!r}",
            where=where,
            remedy="add them, one for each mode",
        )
    return np.array(values)


# The fixed signals that need a place, beside those of the hub's angle.
FIXED: dict[str, tuple[str, Seen]] = {
    "tip": ("tip", "displacement"),
    "tip_dot": ("tip", "displacement"),
    "tip_acceleration": ("tip", "displacement"),
    "tip_deflection": ("tip", "deflection"),
    "root_moment": ("root", "moment"),
}


def check_fixed(beam: Beam | None, name: str, where: str) -> None:
    """Refuse a signal that modal data do not tell of."""
    if isinstance(beam, ModalData) and name in FIXED:
        seen_at(beam, *FIXED[name], where)


def knows(beam: Beam, name: str) -> bool:
    """Return whether a beam, or what stands for it, has one of the fixed signals."""
    if not isinstance(beam, ModalData):
        return True
    place, seen = FIXED[name]
    return any(
        each.name == place and getattr(each, _KEYS[seen]) is not None for each in beam.places
    )
