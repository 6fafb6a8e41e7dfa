"""Arms with published data, each with its source."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from slewctl.arm.parts import Arm, Beam
from slewctl.errors import check_choice


@dataclass(frozen=True)
class Entry:
    """A catalogue entry: how to build the arm, and where its data come from."""

    build: Callable[[], Arm]
    source: str
    uncertain: str


def paper_beam() -> Arm:
    """Return the tapered beam of the paper: no hub, no payload, no damping.

    L = 1 m and m̄ = EI = 1 − (5/6)(x/L)³ (eq. 48 of "New admissible functions for the
    dynamic analysis of a slewing flexible beam").
    """
    taper = (1.0, 0.0, 0.0, -5.0 / 6.0)
    return Arm(Beam(1.0, mass_per_length=taper, bending_stiffness=taper), name="paper beam")


CATALOGUE: dict[str, Entry] = {
    "paper-beam": Entry(
        paper_beam,
        source='"New admissible functions for the dynamic analysis of a slewing flexible beam", '
        "eq. 48",
        uncertain="nothing: a made-up beam with unit properties and no hub",
    ),
}


def get(name: str) -> Arm:
    """Return the catalogue's arm called `name`.

    Raises
    ------
    InputError
        If there is none, with the nearest name.
    """
    return CATALOGUE[check_choice(name, CATALOGUE, "arm")].build()


def names() -> tuple[str, ...]:
    """Return the names of all catalogue arms."""
    return tuple(CATALOGUE)
