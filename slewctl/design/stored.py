"""A controller as named numbers and texts, as files hold it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.design.reference import Reference
from slewctl.numerics.linear_system import LinearSystem

SCHEMA = "slewctl-controller/1"
"""What a file says that slewctl has written."""


def to_data(
    system: LinearSystem,
    method: str,
    delay: float,
    reference: Reference | None,
    state_scale: Array,
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
    return data


def reference_of(data: Mapping[str, Any]) -> Reference | None:
    """Return how the reference angle enters a controller that slewctl wrote."""
    if "reference_B" not in data:
        return None
    through = np.asarray(data["reference_D"], dtype=float).reshape(1, 1)
    return Reference(np.asarray(data["reference_B"], dtype=float).reshape(-1, 1), through)
