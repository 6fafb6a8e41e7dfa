"""A control law in a file, by the names that `slewctl.given` has for its parts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from slewctl._types import FilePath
from slewctl.design.own.forms import FORMS
from slewctl.design.stored import SCHEMA
from slewctl.errors import Faults, InputError, check_path, shown
from slewctl.export import read_data

_GAINS = ("kp", "ki", "kd", "filter_hz")
_FORM = tuple(key for name, keys in FORMS.items() if name != "a system" for key in keys)
_NUMBERS = ("sample_time", "delay", "prewarp_hz")
_TEXTS = ("output", "feedback", "discretise")
_REQUIRED = {"num and den": FORMS["num and den"], "A, B, C and D": ("A", "B", "C"),
             "zeros, poles and gain": ("poles", "gain")}  # fmt: skip


def told_by_file(
    file: FilePath, options: Mapping[str, Any]
) -> tuple[dict[str, Any], Mapping[str, Any]]:
    """Return the options that a file holds, and its whole content if slewctl wrote it.

    Raises
    ------
    InputError
        If it holds no law, part of one, or says what the options contradict.
    """
    path = check_path(file, "file")
    try:
        data = read_data(path)
    except InputError as error:
        raise error.within("file") from error
    found = _known(data)
    _check_whole(data, found)
    faults = Faults()
    faults.add(
        InputError(
            f"{shown(options[key])} is given, the file says {shown(value)}",
            where=key,
            remedy="leave it out, or mend the file",
        )
        for key, value in found.items()
        if key in options and not _same(options[key], value)
    )
    faults.tell()
    return found, data if data.get("schema") == SCHEMA else {}


def _known(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a file holds under the names of a law's parts."""
    found: dict[str, Any] = {key: data[key] for key in (*_FORM, "sections") if key in data}
    gains = {key: _number(data[key]) for key in _GAINS if key in data}
    if gains and "pid" not in found:
        found["pid"] = gains
    found |= {key: _number(data[key]) for key in _NUMBERS if key in data}
    found |= {key: data[key] for key in _TEXTS if key in data}
    if "inputs" in data:
        found["inputs"] = texts(data["inputs"])
    if found.get("sample_time") == 0:
        del found["sample_time"]
    return found


def texts(value: Any) -> list[str]:
    """Return a list of texts, of which a file may hold one alone, or an array without any."""
    return [value] if isinstance(value, str) else [str(text) for text in value]


def _number(value: Any) -> Any:
    return value.item() if isinstance(value, np.ndarray) and value.size == 1 else value


def _check_whole(data: Mapping[str, Any], found: Mapping[str, Any]) -> None:
    holds = ", ".join(map(str, list(data)[:20])) or "nothing"
    forms = [name for name, keys in FORMS.items() if any(key in found for key in keys)]
    if not forms:
        raise InputError(
            f"no control law is in it: it holds {holds}",
            where="file",
            remedy="call its parts A, B, C, D; num, den; zeros, poles, gain; or kp, ki, kd, "
            "filter_hz",
        )
    for key in _REQUIRED.get(forms[0], ()):
        if key not in found and not (forms[0] == "A, B, C and D" and "D" in found and
                                     not {"A", "B", "C"} & found.keys()):  # fmt: skip
            raise InputError(
                f"{key} is missing in it: it holds {holds}",
                where="file",
                remedy=f"write {forms[0]}",
            )


def _same(one: Any, other: Any) -> bool:
    try:
        return bool(np.array_equal(np.asarray(one), np.asarray(other)))
    except (TypeError, ValueError):
        return False
