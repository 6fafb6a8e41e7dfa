"""``[export]``: the numbers that a controller runs with, and its raw units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from slewctl.embedded.options import CodeOptions
from slewctl.errors import InputError
from slewctl.files.table import Count, NonNegative, Positive, Several, Table, told
from slewctl.plant import Objective


class ExportTable(Table):
    """``[export]``."""

    arithmetic: Annotated[str, told("text", "double, float or fixed", "float")] = "double"
    word: Annotated[
        Count | None,
        told("bits", "of fixed point; by default the shortest that lose no more than 1 %", 16),
    ] = None
    fraction: Annotated[
        int | None,
        told("bits", "of them behind the point; by default as many as there is room for", 11),
    ] = None
    counts_per_turn: Annotated[
        Positive | None, told("1", "of the encoder of the angles, after quadrature", 4096.0)
    ] = None
    steps_per_unit: Annotated[
        Positive | None, told("1", "of the converter, per N·m or V", 204.7)
    ] = None
    reversed: Annotated[
        Several[str] | None,
        told(
            "list of text",
            "of angles with counts and command with steps, which run the other way",
            ["theta"],
        ),
    ] = None
    stuck_s: Annotated[
        NonNegative | None,
        told(
            "s",
            "how long a reading may stand still at full command; 0 for any time, by default "
            "the period of the arm's first mode",
            0.3,
        ),
    ] = None


def read_export(table: Mapping[str, Any], objective: Objective) -> CodeOptions:
    """Return how the controller of a design file runs.

    Parameters
    ----------
    table : mapping
        ``[export]``.
    objective : Objective
        It names what the controller reads and commands.

    Raises
    ------
    InputError
        For an impossible value, or a signal that the controller has not.
    """
    keys = {key: value for key, value in table.items() if value is not None}
    keys["reversed"] = tuple(keys.get("reversed", ()))
    try:
        options = CodeOptions(**keys)
        options.check_reversed(objective.sensors, objective.actuator)
    except InputError as error:
        raise error.within("export", ".") from error
    return options
