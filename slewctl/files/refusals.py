"""What pydantic finds wrong in a table, said in this project's words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from slewctl.errors import InputError, shown, suggest
from slewctl.files.schema import Table

T = TypeVar("T", bound=Table)

# What to give where pydantic found something of another type.
_WANTED = {
    "model_type": "a table",
    "dict_type": "a table",
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text in quotes",
    "list_type": "a list",
    "bool_type": "true or false",
}


def validate(content: object, kind: type[T], prefix: tuple[str, ...] = ()) -> T:
    """Return `content` as a table of `kind`.

    Parameters
    ----------
    content : object
        What the TOML file holds at the place.
    kind : type of Table
    prefix : tuple of str
        Keys that lead to the place, for the message.

    Raises
    ------
    InputError
        For the first wrong key, which is the one to mend first.
    """
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise _refusal(kind, prefix, error.errors(include_url=False)[0]) from None


def _refusal(kind: type[Table], prefix: tuple[str, ...], error: Mapping[str, Any]) -> InputError:
    place = tuple(str(part) for part in error["loc"])
    key = ".".join((*prefix, *place))
    if error["type"] == "extra_forbidden":
        remedy = suggest(place[-1], _known_keys(kind, place[:-1]))
        return InputError("unknown key", where=key, remedy=remedy)
    if error["type"] == "missing":
        return InputError("missing", where=key, remedy="add it")
    wanted = _WANTED.get(error["type"], str(error["msg"]).removeprefix("Input should be "))
    if wanted.startswith(("greater", "less")):
        wanted = f"a value {wanted}"
    return InputError(f"{shown(error['input'])} is not allowed", where=key, remedy=f"give {wanted}")


def _known_keys(kind: type[Table], place: tuple[str, ...]) -> tuple[str, ...]:
    """Return the keys that the table at `place` knows."""
    for part in place:
        if part.isdigit():  # a place in a list of tables
            continue
        annotation = kind.model_fields[part].annotation
        options = (annotation, *get_args(annotation))
        kind = next(t for t in options if isinstance(t, type) and issubclass(t, Table))
    return tuple(kind.model_fields)
