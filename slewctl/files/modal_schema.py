"""The keys of an arm that is known by its modes alone."""

from __future__ import annotations

from typing import Annotated, Any

from slewctl.files.table import Count, Finite, Positive, Several, Table, told


class PlaceTable(Table):
    """``[[arm.modal_data.places]]``."""

    name: Annotated[str, told("text", "of the place: tip, root or another", "tip")]
    lever: Annotated[Finite | None, told("m", "from the axis; with shapes", 8.0)] = None
    shapes: Annotated[
        list[Finite] | None,
        told("kg^-½", "deflection per modal coordinate, one for each mode", [0.15, -0.16]),
    ] = None
    moments: Annotated[
        list[Finite] | None,
        told("N·m/(kg^½·m)", "bending moment per modal coordinate", [3.0, 5.0]),
    ] = None


class ModalDataTable(Table):
    """``[arm.modal_data]``."""

    inertia: Annotated[
        Positive,
        told("kg·m²", "about the axis, of all that turns but what [arm.hub] gives", 600.0),
    ]
    frequencies_hz: Annotated[
        list[Positive], told("Hz", "with the hub held, increasing", [0.2, 1.3])
    ]
    coupling: Annotated[
        list[Finite], told("kg^½·m", "with the hub's rotation, for unit modal mass", [20.0, 4.0])
    ]
    places: Annotated[
        Several[PlaceTable] | None,
        told(
            "tables",
            "where something is seen beside the hub's angle",
            [{"name": "tip", "lever": 8.0, "shapes": [0.15, -0.16]}],
        ),
    ] = None


class WingTable(ModalDataTable):
    """``[arm.wings.NAME]``: the modal data of one appendage, or of several equal ones."""

    damping_ratio: Annotated[Any, told("1", "ζ of its hub-locked modes: one, or a list", 0.005)] = (
        0.0
    )
    count: Annotated[Count, told("1", "how many there are of this kind", 2)] = 1
