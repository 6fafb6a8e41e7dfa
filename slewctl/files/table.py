"""What the tables of design files are made of: numbers with a range, and what is said of a key."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Efficiency = Annotated[float, Field(gt=0, le=1)]
Count = Annotated[int, Field(ge=1)]
T = TypeVar("T")
# More is no comparison that anybody reads.
Several = Annotated[list[T], Field(max_length=100)]


def told(unit: str, meaning: str, example: object) -> Any:
    """Return what the reference of design files says of a key.

    Parameters
    ----------
    unit : str
        "1" of a number without one; of what is no number, what it is.
    meaning : str
        A phrase.
    example : object
        A value, as TOML would be read; of a table, one of its keys at least.
    """
    return Field(description=meaning, examples=[example], json_schema_extra={"unit": unit})


class Table(BaseModel):
    """A TOML table that refuses unknown keys and converts nothing."""

    # What is within another table is built with that one, and not by itself too.
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)
