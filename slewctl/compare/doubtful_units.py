"""Values that look as if they were in other units: asked about, never refused.

A beam is judged by two numbers that do not depend on what else the arm is: its slenderness
L/k, where the section's radius of gyration k = √(EI/m̄)/√(E/ρ) follows from the speed of sound
in its material, some 5000 m/s in metals, glass and wood; and its first frequency with the hub
held.  Both lie far within the bounds here for anything from a watch spring to a solar array.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slewctl.arm import Arm, ModalData
from slewctl.model import beam_inertia, beam_mass, frequencies

_SOUND = 5000.0  # m/s
# Stubbier than that it is no beam; thinner, thinner than a hair over a span of metres.
_SLENDERNESS = (3.0, 1e5)
# Hz; from a quarter of an hour for one swing to beyond what a torque on a hub could excite.
_FIRST_HZ = (1e-3, 1e4)
_USUAL = (300.0, 3.0)  # slenderness and Hz, to choose between what it could be
# Of the beam's own inertia and mass, and of its length.
_MOST_INERTIA, _MOST_MASS, _MOST_RADIUS = 1e5, 1e3, 30.0
_MOST_DAMPING = 0.3  # of a structure: it would not ring twice


@dataclass(frozen=True)
class _Guess:
    """A unit that may have been meant: by what it would multiply slenderness and frequency."""

    question: str
    slenderness: float
    frequency: float


_GUESSES = (
    _Guess("is the length in mm?", 1e-3, 1e6),
    _Guess("is the bending stiffness in N·mm²?", 1e3, 1e-3),
    _Guess("is the modulus in MPa?", 1e-3, 1e3),
    _Guess("is the modulus in GPa?", 10**-4.5, 10**4.5),
    _Guess("is the density in g/cm³, or the mass per length in g/mm?", 10**1.5, 10**-1.5),
    _Guess("is the mass per length in g/m?", 10**-1.5, 10**1.5),
)


def unit_notes(arm: Arm) -> tuple[str, ...]:
    """Return questions about values of an arm that look as if they were in other units.

    Parameters
    ----------
    arm : Arm

    Returns
    -------
    tuple of str
        Empty for an arm that looks like one.

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import unit_notes
    >>> ruler = sc.Beam(280.0, 0.353, 1.69)
    >>> unit_notes(sc.Arm(ruler))[0]
    'length 280 m with a first frequency of 1.56e-05 Hz: is the length in mm?'
    """
    return (*_of_modes(arm), *_of_parts(arm), *_of_damping(arm))


def _of_modes(arm: Arm) -> list[str]:
    """Return a question about the beam, or about the frequencies of modal data."""
    hertz = float(frequencies(arm, 1).hz[0])
    if isinstance(arm.beam, ModalData):
        told = f"first frequency of {hertz:.3g} Hz with the hub held: is it in Hz?"
        return [] if _within(hertz, _FIRST_HZ) else [told]
    xi = np.linspace(0.0, 1.0, 33)
    stiffness, mass = arm.beam.stiffness_profile(xi).mean(), arm.beam.mass_profile(xi).mean()
    slenderness = arm.beam.length * _SOUND / math.sqrt(stiffness / mass)
    if _within(slenderness, _SLENDERNESS) and _within(hertz, _FIRST_HZ):
        return []
    told = f"length {arm.beam.length:g} m with a first frequency of {hertz:.3g} Hz"
    likely = [
        (_distance(slenderness * guess.slenderness, hertz * guess.frequency), guess.question)
        for guess in _GUESSES
        if _within(slenderness * guess.slenderness, _SLENDERNESS)
        and _within(hertz * guess.frequency, _FIRST_HZ)
    ]
    return [f"{told}: {min(likely)[1] if likely else 'is all of the beam in SI units?'}"]


def _of_parts(arm: Arm) -> list[str]:
    """Return questions about what is fixed to a beam and much larger than it."""
    if isinstance(arm.beam, ModalData):
        return []
    hub, payload = arm.hub, arm.payload
    inertia, mass = beam_inertia(arm), beam_mass(arm)
    sizes = (
        ("hub inertia", hub.inertia, "kg·m²", inertia, _MOST_INERTIA, "kg·mm² or g·cm²"),
        ("payload inertia", payload.inertia, "kg·m²", inertia, _MOST_INERTIA, "kg·mm² or g·cm²"),
        ("payload mass", payload.mass, "kg", mass, _MOST_MASS, "g"),
        ("hub radius", hub.radius, "m", arm.beam.length, _MOST_RADIUS, "mm"),
    )
    return [
        f"{name} {value:g} {unit} is {value / own:.1e} times the beam's own: is it in {meant}?"
        for name, value, unit, own, most, meant in sizes
        if value > most * own
    ]


def _of_damping(arm: Arm) -> list[str]:
    largest = float(np.max(arm.damping_ratio))
    if largest < _MOST_DAMPING:
        return []
    return [f"damping ratio {largest:g}: is it in percent?"]


def _within(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] <= value <= bounds[1]


def _distance(slenderness: float, hertz: float) -> float:
    """Return how far a beam is from a usual one, in decades."""
    return sum(
        abs(math.log10(value / usual))
        for value, usual in zip((slenderness, hertz), _USUAL, strict=True)
    )
