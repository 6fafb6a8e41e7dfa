"""Tables as TOML text, as a person would write a design file."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables as TOML; what is None is left out, and numbers keep every bit.

    Parameters
    ----------
    tables : mapping of str to value
        Texts, numbers, lists and tables.  The first two levels of tables get a head of their
        own.

    Returns
    -------
    str

    Examples
    --------
    >>> print(toml_text({"title": "An arm", "hub": {"inertia": 0.2}}), end="")
    title = "An arm"
    <BLANKLINE>
    [hub]
    inertia = 0.2
    """
    return "\n".join(_lines(tables, ())).strip() + "\n"


def _lines(table: Mapping[str, Any], way: tuple[str, ...]) -> list[str]:
    held = {key: value for key, value in table.items() if value is not None}
    heads = {key: value for key, value in held.items()
             if isinstance(value, Mapping) and len(way) < 2 and _headed(way, key)}  # fmt: skip
    lines = [f"{_key(key)} = {_value(value)}" for key, value in held.items() if key not in heads]
    for key, value in heads.items():
        place = (*way, key)
        inner = _lines(value, place)
        # Tables alone need no head above their own: each of them tells the whole way.
        head = ["", f"[{'.'.join(map(_key, place))}]"] if not inner or inner[0] else []
        lines += [*head, *inner]
    return lines


def _headed(way: tuple[str, ...], key: str) -> bool:
    return not way or way[0] in ("arm", "variations")


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _text(key)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, complex):
        return f"[{value.real!r}, {value.imag!r}]"
    if isinstance(value, Mapping):
        items = [f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None]
        return "{ " + ", ".join(items) + " }" if items else "{}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)
