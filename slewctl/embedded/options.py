"""How a controller is to be run: the numbers, and the raw units of encoder and converter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from slewctl.design.digital.fixed_point import check_word
from slewctl.errors import InputError, check_choice, check_positive
from slewctl.plant.signals import signal

ARITHMETICS = ("double", "float", "fixed")


@dataclass(frozen=True)
class CodeOptions:
    """How a controller is to be run.

    Attributes
    ----------
    arithmetic : {"double", "float", "fixed"}
    word : int or None
        Bits of a word of fixed point; None for the shortest that lose no more than 1 %.
    fraction : int or None
        Of them behind the point, in readings and command; None for as many as there is room.
    counts_per_turn : float or None
        Of the encoder of every angle, after quadrature; None if readings come in rad.
    steps_per_unit : float or None
        Of the converter, per N·m or V; None if the command goes out in these.
    reversed : tuple of str
        Encoders that count the other way round, and the actuator if it pushes the other way:
        their functions of raw units turn the sign.
    stuck_s : float or None
        How long a reading may stand still in s while the command is at its limit; zero for
        any time, None for one period of the arm's first mode.

    Raises
    ------
    InputError
        For an impossible value.

    Examples
    --------
    >>> CodeOptions("float", counts_per_turn=4096).arithmetic
    'float'
    """

    arithmetic: Literal["double", "float", "fixed"] = "double"
    word: int | None = None
    fraction: int | None = None
    counts_per_turn: float | None = None
    steps_per_unit: float | None = None
    reversed: tuple[str, ...] = ()
    stuck_s: float | None = None

    def __post_init__(self) -> None:
        check_choice(self.arithmetic, ARITHMETICS, "arithmetic")
        for name in ("word", "fraction"):
            if getattr(self, name) is not None and self.arithmetic != "fixed":
                raise InputError(
                    f"{self.arithmetic} has no {name}",
                    where=name,
                    remedy='leave it out, or set arithmetic = "fixed"',
                )
        if self.fraction is not None and self.word is None:
            raise InputError("a fraction of no word", where="fraction", remedy="give word too")
        if self.word is not None:
            check_word(self.word)
        for name in ("counts_per_turn", "steps_per_unit"):
            if getattr(self, name) is not None:
                check_positive(getattr(self, name), name)
        if self.stuck_s:
            check_positive(self.stuck_s, "stuck_s")

    def check_reversed(self, sensors: Sequence[str], actuator: str) -> None:
        """Refuse to reverse what a controller has not, or what has no raw units to be turned in.

        Raises
        ------
        InputError
        """
        for place, name in enumerate(self.reversed):
            where = f"reversed.{place}"
            check_choice(name, [*sensors, actuator], where)
            encoder = name != actuator and signal(name).unit == "rad"
            key = "steps_per_unit" if name == actuator else "counts_per_turn" if encoder else ""
            if not key or getattr(self, key) is None:
                raise InputError(
                    f"{name} has no raw units here, in whose function its sign is turned",
                    where=where,
                    remedy=f"give {key} too" if key else "turn its sign where it is read",
                )
