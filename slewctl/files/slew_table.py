"""``[slew]`` of a design file, with what the slew meets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from slewctl.errors import InputError
from slewctl.files.table import Count, Finite, NonNegative, Positive, Several, Table, told
from slewctl.loop import Conditions, Load, Slew

# Keys of [slew] that are conditions as well: the two that most slews are asked for.
_SHORT = ("saturate", "nonlinear")


class LoadTable(Table):
    """``[[slew.conditions.loads]]``."""

    time_s: Annotated[NonNegative, told("s", "when it begins", 1.5)]
    torque: Annotated[Finite, told("N·m", "on the hub", 0.1)] = Load.torque
    tip_force: Annotated[Finite, told("N", "on the tip, along the arc", 0.2)] = Load.tip_force
    until_s: Annotated[
        Positive | None, told("s", "when it ends; without it the load stays", 1.6)
    ] = None


class ConditionsTable(Table):
    """``[slew.conditions]``: what the slew meets beside limits."""

    rate_limit: Annotated[
        Positive | None, told("N·m/s or V/s", "largest change of the command in a second", 50.0)
    ] = None
    anti_windup: Annotated[
        bool, told("true or false", "whether the controller is told of limits", False)
    ] = Conditions.anti_windup
    coulomb_friction: Annotated[
        NonNegative, told("N·m", "dry friction where the motor's torque acts", 0.02)
    ] = Conditions.coulomb_friction
    static_friction: Annotated[
        NonNegative | None, told("N·m", "what breaks it loose; as large by default", 0.03)
    ] = None
    backlash_deg: Annotated[
        NonNegative, told("deg", "play of the elastic joint, from side to side", 0.1)
    ] = Conditions.backlash_deg
    encoder_counts: Annotated[
        Count | None, told("1", "steps in a turn by which the angle is read", 4096)
    ] = None
    jitter: Annotated[NonNegative, told("s", "how late a sample may be", 0.0005)] = (
        Conditions.jitter
    )
    missed: Annotated[NonNegative, told("1", "probability that a sample is missed", 0.01)] = (
        Conditions.missed
    )
    noise: Annotated[
        bool, told("true or false", "whether the noise of `[controller]` acts", True)
    ] = Conditions.noise
    seed: Annotated[
        Annotated[int, Field(ge=0)] | None, told("1", "of all that is random; 0 by default", 1)
    ] = None
    loads: Annotated[
        Several[LoadTable] | None,
        told("tables", "forces from a time on", [{"time_s": 1.5, "torque": 0.1}]),
    ] = None


class SlewTable(Table):
    """``[slew]``: the turn that is simulated."""

    angle_deg: Annotated[Finite, told("deg", "of the turn", 30.0)]
    duration_s: Annotated[Positive, told("s", "of the reference, shaper and all", 4.0)]
    horizon_s: Annotated[
        Positive | None,
        told("s", "how long is simulated; by default three times the duration", 12.0),
    ] = None
    profile: Annotated[
        str,
        told("text", "minimum-jerk, versine, trapezoid, s-curve or rigid-time-optimal", "s-curve"),
    ] = Slew.profile
    shaper: Annotated[
        str | None,
        told("text", "zv, mzv, zvd, ei, ei2, ei3, sampled or robust, for what the loop rings with",
             "zvd"),
    ] = None  # fmt: skip
    modes: Annotated[Count | None, told("1", "how many modes are shaped; one by default", 2)] = None
    frequency_error: Annotated[
        Positive | None,
        told("1", "of a robust shaper: how far off frequencies may be; 0.1 by default", 0.15),
    ] = None
    saturate: Annotated[
        bool, told("true or false", "whether torque and voltage are held within the drive's limits",
                   True),
    ] = False  # fmt: skip
    nonlinear: Annotated[
        bool, told("true or false", "whether the arm moves by the nonlinear equations", True)
    ] = False
    conditions: Annotated[
        ConditionsTable | None,
        told("table", "friction, play, encoder, clock, noise and loads",
             {"coulomb_friction": 0.02}),
    ] = None  # fmt: skip


def slew_of_table(keys: Mapping[str, Any]) -> Slew:
    """Return the slew that right keys of a table tell; those that are wrong are left out.

    Parameters
    ----------
    keys : mapping of str to object

    Raises
    ------
    InputError
    """
    told_keys = dict(keys)
    short = {key: told_keys.pop(key) for key in _SHORT if key in told_keys}
    table = told_keys.pop("conditions", None)
    met = dict(table) if table is not None else {}
    try:
        loads = tuple(Load(**dict(load)) for load in met.pop("loads", None) or ())
    except InputError as error:
        raise error.within("slew.conditions", ".") from error
    conditions = Conditions(**short, **met, loads=loads)
    if "duration_s" not in told_keys:
        told_keys = {"angle_deg": told_keys.get("angle_deg", 1.0), "duration_s": 1.0}
    return Slew(**{"angle_deg": 1.0, **told_keys}, conditions=conditions)
