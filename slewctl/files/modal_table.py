"""``[arm.modal_data]`` and ``[arm.wings]``: an arm known by its modes with the hub held."""

from __future__ import annotations

from collections.abc import Mapping

from slewctl.arm import Arm, Hub, ModalData, Place, equal_appendages, stacked_appendages
from slewctl.errors import InputError
from slewctl.files.faults import Faults, placed
from slewctl.files.modal_schema import ModalDataTable, WingTable


def data_of_table(table: ModalDataTable) -> ModalData:
    """Return the modal data of a table.

    Raises
    ------
    InputError
        As `ModalData`.
    """
    places = tuple(
        placed(f"modal_data.places.{k}", Place, **place.model_dump())
        for k, place in enumerate(table.places or ())
    )
    return ModalData(table.inertia, table.frequencies_hz, table.coupling, places)


def arm_of_wings(tables: Mapping[str, WingTable], hub: Hub) -> Arm:
    """Return the arm of several wings, each a table with a name.

    Raises
    ------
    InputError
        For everything that is wrong with them.
    """
    faults = Faults()
    wings = {name: faults.attempt(_wing, name, table) for name, table in tables.items()}
    faults.tell()
    return stacked_appendages({name: wing for name, wing in wings.items() if wing}, hub)


def _wing(name: str, table: WingTable) -> Arm:
    try:
        wing = Arm(data_of_table(table), damping_ratio=table.damping_ratio)
        return equal_appendages(wing, table.count)
    except InputError as error:
        key = error.where.removeprefix("modal_data.").removeprefix("arm.")
        raise error.at(f"wings.{name}.{key}") from error
