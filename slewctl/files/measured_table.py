"""``[measured]``: a frequency response on which a design's controller is judged as well."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from slewctl.files.table import NonNegative, Positive, Table, told

if TYPE_CHECKING:
    from slewctl.measured.response import Response


class MeasuredTable(Table):
    """``[measured]``."""

    file: Annotated[
        str, told("text", "the response, by its path from the design file", "response.csv")
    ]
    columns: Annotated[
        dict[str, str] | None,
        told("table", "the file's own names of columns", {"gain_db": "Mag (dB)"}),
    ] = None
    actuator: Annotated[
        str | None, told("text", "what was driven; by default what is commanded", "torque")
    ] = None
    sensor: Annotated[
        str | None, told("text", "what was measured; by default what the controller reads", "theta")
    ] = None
    sample_time: Annotated[
        NonNegative,
        told("s", "the clock that held the input and sampled the output; 0 without one", 0.005),
    ] = 0.0
    factor: Annotated[
        Positive, told("1", "makes the file's values SI: 0.0174533 for degrees", 0.0174533)
    ] = 1.0
    averages: Annotated[
        Positive | None, told("1", "independent averages that the coherence is of", 13.3)
    ] = None
    unstable_poles: Annotated[
        Annotated[int, Field(ge=0)], told("1", "unstable poles of what was measured", 0)
    ] = 0
    poles_at_zero: Annotated[
        Annotated[int, Field(ge=0)] | None,
        told("1", "its poles at zero; by default those of the arm", 1),
    ] = None
    requirements: Annotated[
        dict[str, Any] | None,
        told(
            "table",
            "limits on it, of stability and margins; by default those of [requirements]",
            {"modulus_margin": 0.5},
        ),
    ] = None


@dataclass(frozen=True)
class MeasuredPlant:
    """A measured response with what is assumed of it and required on it.

    Attributes
    ----------
    response : Response
    unstable_poles, poles_at_zero : int
    requirements : mapping of str to float
        That a response can tell.
    left_out : tuple of str
        Requirements of the design that it cannot.
    digest : str
        Of the file.
    """

    response: Response
    unstable_poles: int
    poles_at_zero: int
    requirements: Mapping[str, float | bool]
    left_out: tuple[str, ...]
    digest: str
