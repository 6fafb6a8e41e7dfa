"""What pydantic finds wrong in a table, said in this project's words."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from typing import Any, TypeVar, get_args

from pydantic import ValidationError, create_model

from slewctl.errors import InputError, shown, suggest
from slewctl.files.faults import Faults, missing
from slewctl.files.fields import Table

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
        For every wrong key.
    """
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        faults = Faults()
        faults.add(_refusals(error, kind, prefix))
        faults.tell()
        raise


def validate_each(
    content: Mapping[str, Any], kind: type[Table], faults: Faults, prefix: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Return those keys of a table that are right; add what is wrong with the others.

    Parameters
    ----------
    content : mapping
        What the TOML file holds.
    kind : type of Table
        That of the whole table.  Of a file, each table is such a dictionary again.
    faults : Faults
    prefix : tuple of str
        Keys that lead to the table.
    """
    found = {}
    names = {field.alias or name: name for name, field in kind.model_fields.items()}
    for key in content:
        if key not in names and kind.model_config["extra"] == "forbid":
            faults.add([_unknown(key, ".".join((*prefix, key)), kind)])
        elif key not in names:
            found[key] = content[key]
    for key, name in names.items():
        field = kind.model_fields[name]
        inner = _table(field.annotation)
        if key not in content and field.is_required():
            faults.add([missing(".".join((*prefix, key)))])
        elif key not in content and (prefix or inner is None):
            found[name] = field.get_default(call_default_factory=True)
        elif inner and not prefix and isinstance(content.get(key, {}), dict):
            if key in content or field.default is not None:
                found[name] = validate_each(content.get(key, {}), inner, faults, (key,))
        else:
            try:
                found[name] = getattr(_only(kind, name).model_validate({key: content[key]}), name)
            except ValidationError as error:
                faults.add(_refusals(error, kind, prefix))
    return found


@cache
def _only(kind: type[Table], name: str) -> type[Table]:
    """Return the table that has but one of the keys."""
    field = kind.model_fields[name]
    made: type[Table] = create_model(  # type: ignore[call-overload]
        kind.__name__, __base__=Table, **{name: (field.annotation, field)}
    )
    return made


def _refusals(
    error: ValidationError, kind: type[Table], prefix: tuple[str, ...]
) -> list[InputError]:
    return [_refusal(kind, prefix, each) for each in error.errors(include_url=False)]


def _refusal(kind: type[Table], prefix: tuple[str, ...], error: Mapping[str, Any]) -> InputError:
    place = tuple(str(part) for part in error["loc"])
    key = ".".join((*prefix, *place))
    if error["type"] == "extra_forbidden":
        return _unknown(place[-1], key, _table_at(kind, place[:-1]))
    if error["type"] == "missing":
        return missing(key)
    if error["type"] == "too_long":
        length, most = len(error["input"]), error["ctx"]["max_length"]
        return InputError(f"{length} are too many", where=key, remedy=f"give at most {most}")
    wanted = _WANTED.get(error["type"], str(error["msg"]).removeprefix("Input should be "))
    if wanted.startswith(("greater", "less")):
        wanted = f"a value {wanted}"
    return InputError(f"{shown(error['input'])} is not allowed", where=key, remedy=f"give {wanted}")


def _unknown(name: str, key: str, kind: type[Table]) -> InputError:
    known = [field.alias or name for name, field in kind.model_fields.items()]
    return InputError("unknown key", where=key, remedy=partial(suggest, name, known))


def _table_at(kind: type[Table], place: tuple[str, ...]) -> type[Table]:
    """Return the kind of the table at `place`."""
    for part in place:
        if not part.isdigit():  # a place in a list of tables
            kind = _table(kind.model_fields[part].annotation) or kind
    return kind


def _table(annotation: Any) -> type[Table] | None:
    """Return the kind of table that a key holds, None if it holds something else."""
    options = (annotation, *get_args(annotation))
    return next((t for t in options if isinstance(t, type) and issubclass(t, Table)), None)
