"""An arm of which a data sheet, a test or a finite-element code tells the modes alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slewctl._types import Array
from slewctl.arm.beam import Beam
from slewctl.arm.magnitudes import check_size
from slewctl.arm.profiles import ProfileSpec
from slewctl.errors import InputError, check_each, check_number, shown

_UNKNOWN = ("length", "mass_per_length", "bending_stiffness")
# Of J, below which what is left of it beside Σδ² is rounding.
_NOTHING_LEFT = 1e-12


@dataclass(frozen=True)
class Place:
    """A point of the structure where something is seen: what each mode shows there.

    Parameters
    ----------
    name : str
        Letters, digits and underscores; ``tip`` is what the signals of the tip are of, and
        ``root`` where the root moment is.
    lever : float, optional
        Distance from the axis in m: the point moves by lever·θ along the arc as the rigid
        structure turns.
    shapes : sequence of float, optional
        Deflection at the point per modal coordinate, in kg^-½.
    moments : sequence of float, optional
        Bending moment there per modal coordinate, in N·m/(kg^½·m).

    Examples
    --------
    >>> import slewctl as sc
    >>> sc.Place("tip", lever=8.0, shapes=(0.15, -0.16)).name
    'tip'
    """

    name: str
    lever: float | None = None
    shapes: Sequence[float] | None = None
    moments: Sequence[float] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not _is_a_name(self.name):
            raise InputError(
                f"{shown(self.name)} cannot name a place",
                where="place.name",
                remedy="give letters, digits and underscores, a letter first",
            )
        if self.lever is not None:
            object.__setattr__(self, "lever", check_number(self.lever, "place.lever"))
        for name in ("shapes", "moments"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _numbers(getattr(self, name), f"place.{name}"))
        if (self.lever is None) != (self.shapes is None):
            raise InputError(
                "one of lever and shapes without the other",
                where=f"place.{'shapes' if self.shapes is None else 'lever'}",
                remedy="give both, of a point that moves, or moments alone",
            )

    def renamed(self, prefix: str, kept: Sequence[int | None]) -> Place:
        """Return the place under another name, with modes in another order or none (zero)."""

        def ordered(values: Sequence[float] | None) -> tuple[float, ...] | None:
            if values is None:
                return None
            return tuple(0.0 if k is None else values[k] for k in kept)

        name = f"{prefix}_{self.name}"
        return Place(name, self.lever, ordered(self.shapes), ordered(self.moments))


@dataclass(frozen=True)
class ModalData(Beam):
    """A flexible structure on the axis, known by its modes with the hub held.

    J θ̈ + Σ δ_k η̈_k = τ,   η̈_k + 2ζ_kω_k η̇_k + ω_k² η_k = −δ_k θ̈

    It takes the place of the beam of an `Arm`, whose damping ratios are then those of these
    modes.  What needs a beam, such as a large slew or another basis than ``modal``, refuses it.

    Parameters
    ----------
    inertia : float
        J in kg·m²: of the whole rigid structure about the axis, or of the appendage alone if
        the arm's hub has its own.
    frequencies_hz : sequence of float
        ω_k/2π with the hub held, in Hz, increasing.
    coupling : sequence of float
        δ_k in kg^½·m, for modes of unit modal mass; the signs are those of the modes.
    places : sequence of Place
        Where something is measured or wanted beside the hub's angle.

    Raises
    ------
    InputError
        For lists of different lengths or frequencies that do not increase.

    Examples
    --------
    >>> import slewctl as sc
    >>> wings = sc.ModalData(inertia=600.0, frequencies_hz=(0.2, 1.3), coupling=(20.0, 4.0))
    >>> arm = sc.Arm(wings, damping_ratio=(0.005, 0.01), name="satellite")
    >>> print(sc.truth(arm))
    truth of satellite: its 2 modes as given, to 1.358 Hz
    """

    length: float = field(init=False, repr=False, compare=False)
    mass_per_length: ProfileSpec = field(init=False, repr=False, compare=False)
    bending_stiffness: ProfileSpec = field(init=False, repr=False, compare=False)
    inertia: float
    frequencies_hz: Sequence[float]
    coupling: Sequence[float]
    places: Sequence[Place] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "inertia", check_size(self.inertia, "modal_data.inertia"))
        for name, check in (("frequencies_hz", check_size), ("coupling", check_number)):
            values = _numbers(getattr(self, name), f"modal_data.{name}", check)
            object.__setattr__(self, name, values)
        object.__setattr__(self, "places", tuple(self.places))
        modes = len(self.frequencies_hz)
        if not modes:
            raise InputError(
                "no mode", where="modal_data.frequencies_hz", remedy="give at least one"
            )
        steps = np.diff(self.frequencies_hz)
        if np.any(steps < 0):
            raise InputError(
                "the frequencies do not increase",
                where=f"modal_data.frequencies_hz.{int(np.argmax(steps < 0)) + 1}",
                remedy="sort the modes by frequency, with their couplings and ratios",
            )
        self._check_length(self.coupling, "coupling")
        names = []
        for k, place in enumerate(self.places):
            where = f"places.{k}"
            if not isinstance(place, Place) or place.name in names:
                raise InputError(
                    f"{shown(place)} is no place, or names one a second time",
                    where=f"modal_data.{where}",
                    remedy="give a slewctl.Place for each point",
                )
            names.append(place.name)
            for key in ("shapes", "moments"):
                if getattr(place, key) is not None:
                    self._check_length(getattr(place, key), f"{where}.{key}")

    def _check_length(self, values: Sequence[float], key: str) -> None:
        if len(values) != len(self.frequencies_hz):
            raise InputError(
                f"{len(values)} value{'s' if len(values) != 1 else ''} for "
                f"{len(self.frequencies_hz)} modes",
                where=f"modal_data.{key}",
                remedy="give one for each frequency",
            )

    def __getattr__(self, name: str) -> Any:
        """Refuse what is asked of a beam."""
        if name in _UNKNOWN:
            raise InputError(
                f"an arm that is known by its modes alone has no {name.replace('_', ' ')}",
                where=f"beam.{name}",
                remedy="describe its beam, or ask what modal data tell: see ModalData",
            )
        raise AttributeError(name)

    @property
    def modes(self) -> int:
        """How many modes are given."""
        return len(self.frequencies_hz)

    @property
    def omega(self) -> Array:
        """ω_k in rad/s, shape (modes,)."""
        return 2 * np.pi * np.array(self.frequencies_hz)

    def place(self, name: str, where: str) -> Place:
        """Return the place called `name`; refuse one that the data do not tell."""
        for place in self.places:
            if place.name == name:
                return place
        known = ", ".join(place.name for place in self.places) or "none"
        hub = (
            ""
            if name != "tip"
            else (
                "; of the hub's angle alone a point 1 m from the axis that does not bend: "
                'name = "tip", lever = 1.0, shapes all zero'
            )
        )
        raise InputError(
            f"the modal data tell nothing of a place {name!r}",
            where=where,
            remedy=f"add it to their places ({known} so far){hub}",
        )

    def lever(self, name: str) -> float:
        """Return the distance in m from the axis of the place called `name`."""
        lever = self.place(name, "modal_data.places").lever
        if lever is None:
            raise InputError(
                f"the data of the place {name!r} are of its moment alone",
                where="modal_data.places",
                remedy="give its lever and shapes",
            )
        return lever

    def table(self) -> dict[str, Any]:
        """Return the data as the table of a design file."""
        places = [{key: value for key, value in vars(place).items() if value is not None}
                  for place in self.places]  # fmt: skip
        return {
            "inertia": self.inertia,
            "frequencies_hz": self.frequencies_hz,
            "coupling": self.coupling,
            "places": places or None,
        }

    def rigid_remainder(self, hub_inertia: float) -> float:
        """Return J − Σδ² with the hub's own inertia, in kg·m²: what takes no part in any mode.

        Raises
        ------
        InputError
            If nothing is left: no structure has such modes.
        """
        whole, moved = self.inertia + hub_inertia, float(np.sum(np.square(self.coupling)))
        if not whole - moved > _NOTHING_LEFT * whole:
            raise InputError(
                f"Σδ² = {moved:.6g} kg·m² is not less than the inertia of {whole:.6g} kg·m²",
                where="modal_data.coupling",
                remedy="check units and normalisation: δ is for modes of unit modal mass, in "
                "kg^½·m, and the inertia that of all that turns",
            )
        return whole - moved

    def scaled(
        self, *, frequency: float = 1.0, coupling: float = 1.0, inertia: float = 1.0
    ) -> ModalData:
        """Return the data with all frequencies, all couplings or the inertia times a factor."""
        return replace(
            self,
            inertia=inertia * self.inertia,
            frequencies_hz=tuple(frequency * f for f in self.frequencies_hz),
            coupling=tuple(coupling * delta for delta in self.coupling),
        )


def require_beam(beam: Beam, where: str) -> None:
    """Refuse modal data where a beam is needed.

    Parameters
    ----------
    beam : Beam
    where : str
        What needs it, for the message.

    Raises
    ------
    InputError

    Examples
    --------
    >>> from slewctl.arm import Beam, require_beam
    >>> require_beam(Beam(1.0, 1.0, 1.0), "recommend")
    """
    if isinstance(beam, ModalData):
        raise InputError(
            "it needs an arm with a beam, and this one is known by its modes alone",
            where=where,
            remedy="describe the beam, or judge designs on the modes by themselves",
        )


def _is_a_name(name: str) -> bool:
    return name.isascii() and name.isidentifier() and not name.startswith("_")


def _numbers(given: object, where: str, check: Any = check_number) -> tuple[float, ...]:
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, str | Mapping) or not isinstance(given, Sequence):
        raise InputError(
            f"{shown(given)} is not a list of numbers", where=where, remedy="give a list"
        )
    return check_each(given, where, check)
