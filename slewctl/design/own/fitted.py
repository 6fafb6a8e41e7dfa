"""A law as options tell it, fitted to the signals of a plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import wraps
from typing import Any

from slewctl.design.own.fit_signals import fitted
from slewctl.design.own.given_controller import given, read_options
from slewctl.design.result import Controller
from slewctl.plant import GeneralisedPlant, check_plant


@wraps(given)
def given_on_plant(plant: GeneralisedPlant, **options: Any) -> Controller:
    """Return `given` as a design method: a plant comes first and says which signals there are."""
    check_plant(plant, "design")
    return fitted_law(options, plant.sensors, plant.actuator)


def fitted_law(options: Mapping[str, Any], sensors: Sequence[str], actuator: str) -> Controller:
    """Return the law that options of `given` tell, for these signals of a plant.

    Parameters
    ----------
    options : mapping of str to object
    sensors : sequence of str
        All that the plant measures.
    actuator : {"torque", "voltage"}
        What the law commands where it does not say so itself.

    Returns
    -------
    Controller

    Raises
    ------
    InputError
        As `given` and `fitted`.

    Examples
    --------
    >>> fitted_law({"pid": {"kp": 20.0}}, ["theta", "root_moment"], "voltage").sensors
    ('theta', 'root_moment')
    """
    return fitted(read_options(options, actuator), sensors, actuator)
