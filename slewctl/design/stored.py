"""A controller as named numbers and texts, as files hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.design.digital.arithmetic import Arithmetic
from slewctl.design.reference import Reference
from slewctl.errors import InputError
from slewctl.numerics.linear_system import LinearSystem

SCHEMA = "slewctl-controller/1"
"""What a file says that slewctl has written."""


def to_data(
    system: LinearSystem,
    method: str,
    delay: float,
    reference: Reference | None,
    state_scale: Array,
    entry: Array | None,
    arithmetic: Arithmetic | None,
) -> dict[str, Any]:
    """Return a controller as what `slewctl.given` takes, and what else makes it the same again."""
    data: dict[str, Any] = {
        "schema": SCHEMA,
        "method": method,
        **{name: getattr(system, name) for name in "ABCD"},
        "inputs": list(system.input_labels),
        "output": system.output_labels[0],
        "feedback": "positive",
        "sample_time": system.sample_time,
        "delay": delay,
        "states": list(system.state_labels),
        "state_scale": state_scale,
    }
    if reference is not None:
        data |= {"reference_B": reference.B, "reference_D": reference.D}
    if entry is not None:
        data["entry"] = entry
    if arithmetic is not None:
        told = asdict(arithmetic)
        data |= {f"arithmetic_{name}": np.array(v, dtype=int) if isinstance(v, tuple) else v
                 for name, v in told.items()}  # fmt: skip
    return data


def arithmetic_of(data: Mapping[str, Any], system: LinearSystem) -> Arithmetic | None:
    """Return the numbers that a controller is rounded to which slewctl wrote."""
    if "arithmetic_kind" not in data:
        return None
    kind = str(np.ravel(data["arithmetic_kind"])[0])
    if kind == "float":
        return Arithmetic("float")
    try:
        told = {
            name: [int(bits) for bits in np.ravel(data[f"arithmetic_{name}"])]
            for name in ("word", "readings", "states", "command", "angle", "shifts")
        }
        lengths = [len(told[name]) for name in told]
        expected = [1, system.ninputs, system.nstates, 1, 1, system.nstates + 1]
        if kind != "fixed" or lengths != expected:
            raise ValueError
    except (KeyError, ValueError, TypeError, OverflowError):
        raise InputError(
            "the word formats are not those of such a controller",
            where="file: arithmetic",
            remedy="write the file again with Controller.save",
        ) from None
    return Arithmetic(
        "fixed", told["word"][0], tuple(told["readings"]), tuple(told["states"]),
        told["command"][0], told["angle"][0], tuple(told["shifts"]),
    )  # fmt: skip


def entry_of(data: Mapping[str, Any], states: int) -> Array | None:
    """Return how the input enters the states of an observer that slewctl wrote."""
    if "entry" not in data:
        return None
    found = np.asarray(data["entry"], dtype=float).reshape(-1, 1)
    if len(found) != states or not np.isfinite(found).all():
        raise InputError(
            f"{len(found)} numbers, or some that are not finite, for {states} states",
            where="file: entry",
            remedy="write the file again with Controller.save",
        )
    return found


def reference_of(data: Mapping[str, Any]) -> Reference | None:
    """Return how the reference angle enters a controller that slewctl wrote."""
    if "reference_B" not in data:
        return None
    through = np.asarray(data["reference_D"], dtype=float).reshape(1, 1)
    return Reference(np.asarray(data["reference_B"], dtype=float).reshape(-1, 1), through)
