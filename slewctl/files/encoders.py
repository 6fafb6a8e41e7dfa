"""``[controller.noise]``: an encoder in the place of a number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from slewctl.errors import InputError
from slewctl.files.chosen_tables import EncoderTable
from slewctl.files.faults import Faults
from slewctl.files.refusals import validate
from slewctl.plant import SIGNALS, encoder_noise

_NOISE = "controller.noise"


def with_encoder_noise(content: Mapping[str, Any], faults: Faults) -> Mapping[str, Any]:
    """Return what a file holds with the density of each encoder's noise in its place.

    Parameters
    ----------
    content : mapping
        Of the whole file.
    faults : Faults
        What is wrong with an encoder is added; a density of one stands for it then.
    """
    controller = content.get("controller")
    noise = controller.get("noise") if isinstance(controller, Mapping) else None
    if not isinstance(controller, Mapping) or not isinstance(noise, Mapping):
        return content
    clock = controller.get("sample_time")
    densities = {
        name: (faults.attempt(_density, name, value, clock) or 1.0)
        if isinstance(value, Mapping)
        else value
        for name, value in noise.items()
    }
    return {**content, "controller": {**controller, "noise": densities}}


def _density(name: str, given: Mapping[str, Any], clock: object) -> float:
    place = f"{_NOISE}.{name}"
    table = validate(given, EncoderTable, (*_NOISE.split("."), name))
    if name in SIGNALS and SIGNALS[name].unit != "rad":
        raise InputError(
            f"an encoder reads an angle, and {name} is in {SIGNALS[name].unit}",
            where=place,
            remedy="give its noise as a number, per √Hz",
        )
    if table.sample_time is not None:
        return encoder_noise(table.encoder_counts, table.sample_time)
    if isinstance(clock, bool) or not isinstance(clock, int | float) or not clock > 0:
        raise InputError(
            "the controller has no sample_time to read the encoder by",
            where=place,
            remedy="give the encoder one, as in { encoder_counts = 4096, sample_time = 0.005 }",
        )
    return encoder_noise(table.encoder_counts, clock)
