"""Arms with published data, each with its source, its published frequencies and its doubts.

An `Arm` carries one beam.  A hub with N equal appendages in a symmetric star is described
by one of them: turning the hub drives only the motion in which all appendages bend alike,
and that is the motion of one appendage with 1/N of the hub's inertia and friction, driven
by 1/N of the torque.  The other N − 1 families of modes leave the hub at rest; they are the
hub-locked modes of the same arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from slewctl.arm.beam import Beam
from slewctl.arm.hub import Hub
from slewctl.arm.made_up import harmonic_drive_boom, ruler_on_servo, two_wing_satellite
from slewctl.arm.masses import Payload
from slewctl.arm.motor import Motor
from slewctl.arm.nrel_blade import EDGEWISE_STIFFNESS, MASS_PER_LENGTH, STATIONS
from slewctl.arm.parts import Arm
from slewctl.arm.profiles import Stations
from slewctl.errors import check_choice

# Exact by definition: the international foot and pound, and standard gravity.
FOOT = 0.3048  # m
POUND_FORCE = 0.45359237 * 9.80665  # N
SLUG = POUND_FORCE / FOOT  # kg


@dataclass(frozen=True)
class Published:
    """Frequencies that a source prints for an arm, and how well they are met.

    Attributes
    ----------
    boundary : {"hub-locked", "free"}
        Whether the hub was held, or turned freely without torque.
    frequencies_hz : tuple of (int, float)
        Mode number and frequency in Hz.
    agreement : float
        Bound of their relative differences from the arm's converged frequencies.
    kind : {"measured", "computed"}
    source : str
    """

    boundary: Literal["hub-locked", "free"]
    frequencies_hz: tuple[tuple[int, float], ...]
    agreement: float
    kind: Literal["measured", "computed"]
    source: str


@dataclass(frozen=True)
class SuggestedDamping:
    """Damping ratios to design with, where an arm as published has none or leaves it open.

    Attributes
    ----------
    ratio : float or tuple of float
        As `Arm.damping_ratio`.
    origin : {"measured", "published", "assumed"}
    source : str
        Where the ratio stands, or why it is assumed.
    """

    ratio: float | tuple[float, ...]
    origin: Literal["measured", "published", "assumed"]
    source: str

    def __str__(self) -> str:
        ratios = self.ratio if isinstance(self.ratio, tuple) else (self.ratio,)
        return f"{', '.join(f'{ratio:g}' for ratio in ratios)} ({self.origin}: {self.source})"


@dataclass(frozen=True)
class Entry:
    """A catalogue entry: how to build the arm, and where its data come from.

    Attributes
    ----------
    build : callable
        Returns the arm.
    summary : str
        One line for a table.
    source : str
        Citation of the parameters.
    uncertain : str
        What is not known about them, or known to be wrong.
    damping : SuggestedDamping
        For `damped`; the arm itself has what its source gives.
    published : tuple of Published
        Frequencies in print, where there are any.
    """

    build: Callable[[], Arm]
    summary: str
    source: str
    uncertain: str
    damping: SuggestedDamping
    published: tuple[Published, ...] = ()


def paper_beam() -> Arm:
    """Return the tapered beam of the paper: no hub, no payload, no damping.

    L = 1 m and m̄ = EI = 1 − (5/6)(x/L)³ (eq. 48 of "New admissible functions for the
    dynamic analysis of a slewing flexible beam").
    """
    taper = (1.0, 0.0, 0.0, -5.0 / 6.0)
    return Arm(Beam(1.0, mass_per_length=taper, bending_stiffness=taper), name="paper beam")


def quanser_flexible_link() -> Arm:
    """Return Quanser's rotary flexible link on its SRV02 servo (high gear), as a beam.

    The 0.065 kg of the link are spread over its 0.381 m (15 in), so that the rigid inertia
    about the axis is the vendor's m L²/3.  The vendor's J_eq of the servo contains the rotor.
    """
    length, mass = 15 * 0.0254, 0.065
    motor = Motor(
        resistance=2.6,
        torque_constant=7.68e-3,
        back_emf_constant=7.68e-3,
        gear_ratio=70,
        gear_efficiency=0.9,
        motor_efficiency=0.69,
    )
    return Arm(
        Beam(length, mass / length, 200e9 * 9.32e-13),
        Hub(inertia=0.00208, friction=0.015),
        motor=motor,
        name="Quanser rotary flexible link",
    )


def sheffield_manipulator() -> Arm:
    """Return the aluminium flexible manipulator of Tokhi, Azad, Mohamed and Ahmad."""
    width, thickness = 19.008e-3, 3.2004e-3
    return Arm(
        Beam(0.9, 2710 * width * thickness, 71e9 * 5.1924e-11),
        Hub(inertia=5.8598e-4),
        damping_ratio=(0.026, 0.038, 0.04),
        name="Sheffield flexible manipulator",
    )


def flexible_spacecraft() -> Arm:
    """Return one of the four equal appendages of Junkins and Kim's hub, with its quarter.

    The whole hub has 8 slug·ft²; the torque of this arm is a quarter of the hub's.
    """
    stiffness = 0.1584e10 * (6 / 12) * (0.125 / 12) ** 3 / 12  # lbf·ft²
    return Arm(
        Beam(4 * FOOT, 0.0271875 * SLUG / FOOT, stiffness * POUND_FORCE * FOOT**2),
        Hub(inertia=8 * SLUG * FOOT**2 / 4, radius=1 * FOOT),
        Payload(mass=0.156941 * SLUG, inertia=0.0018 * SLUG * FOOT**2),
        name="hub with four appendages",
    )


def nrel_5mw_rotor() -> Arm:
    """Return one blade of the NREL 5-MW turbine, in the rotor plane, with a third of the hub.

    The hub is the rotor's hub and the generator, rigidly geared 97 : 1; the torque of this
    arm is a third of that on the low-speed shaft.
    """
    scale = 1.04536  # the report's factor, which brings the blade to its stated mass
    return Arm(
        Beam(
            61.5,
            Stations(STATIONS, tuple(scale * value for value in MASS_PER_LENGTH)),
            Stations(STATIONS, EDGEWISE_STIFFNESS),
        ),
        Hub(inertia=(115_926 + 97**2 * 534.116) / 3, radius=1.5),
        damping_ratio=0.00477465,
        name="NREL 5-MW blade, edgewise",
    )


def wright_beam() -> Arm:
    """Return the uniform beam on which rotating-blade codes are verified."""
    return Arm(Beam(31.623, 100.0, 1e8), name="uniform beam of Wright et al.")


def hodges_pierce_taper() -> Arm:
    """Return Hodges and Pierce's tapered beam: m̄ and EI both ∝ 1 − x/(2L)."""
    return Arm(Beam(1.0, (1.0, -0.5), (1.0, -0.5)), name="taper of Hodges and Pierce")


_NONE_PUBLISHED = "its source gives none; half a percent is usual for a bare metal beam"


def _in_hz(*omega: float) -> tuple[tuple[int, float], ...]:
    """Number modes given in rad/s and turn them into Hz."""
    return tuple((mode, value / (2 * math.pi)) for mode, value in enumerate(omega, 1))


CATALOGUE: dict[str, Entry] = {
    "paper-beam": Entry(
        paper_beam,
        "tapered beam without hub",
        source='"New admissible functions for the dynamic analysis of a slewing flexible beam", '
        "eq. 48",
        uncertain="nothing: a made-up beam with unit properties and no hub",
        damping=SuggestedDamping(0.005, "assumed", _NONE_PUBLISHED),
        published=(
            Published(
                "free",
                ((1, 2.927301), (2, 8.760392)),
                agreement=4e-5,
                kind="computed",
                source="same paper, tables 2 and 3, five of its new functions (upper bounds)",
            ),
        ),
    ),
    "quanser-flexible-link": Entry(
        quanser_flexible_link,
        "laboratory servo with a steel ruler",
        source="Quanser Inc., Rotary Flexible Link: user manual and experiment set-up script",
        uncertain="the vendor's one-mode model has 3 Hz with the hub held, while dips in "
        "published frequency responses put the first two modes at 4.12 and about 26 Hz (2 and "
        "3 % above this beam, on a frequency grid of 8 %); whether the link is 0.381 m or, as "
        "newer manuals say, 0.419 m (3.49 Hz); the clamp's radius (0 here); damping "
        "(none here, none published)",
        damping=SuggestedDamping(
            0.01, "assumed", "none is published; one percent for a steel ruler screwed to its clamp"
        ),
        published=(
            Published(
                "hub-locked",
                ((1, 4.12), (2, 26.0)),
                agreement=0.03,
                kind="measured",
                source="dips in the frequency-response data published with A. Yanagisawa, "
                "K. Ohki, SICE Int. Symp. on Control Systems, 2026",
            ),
        ),
    ),
    "sheffield-manipulator": Entry(
        sheffield_manipulator,
        "laboratory aluminium strip, direct drive",
        source="Z. Mohamed, M. A. Ahmad, Hybrid input shaping and feedback control schemes of a "
        "flexible robot manipulator, IFAC World Congress 2008; rig of M. O. Tokhi, A. K. M. Azad",
        uncertain="quoted at second hand; other papers on the rig give 0.96 m and 12, 35 and "
        "65 Hz, which do not go together (11.9, 32.2 and 58.5 Hz); damping ratios are given for "
        "three modes, here the third holds for all that follow; motor constants are not given",
        damping=SuggestedDamping((0.026, 0.038, 0.04), "published", "same paper, three modes"),
        published=(
            Published(
                "free",
                ((1, 13.0), (2, 35.0), (3, 65.0)),
                agreement=0.5 / 13,
                kind="computed",
                source="same paper, in whole Hz",
            ),
        ),
    ),
    "flexible-spacecraft": Entry(
        flexible_spacecraft,
        "hub with four appendages and tip masses",
        source="J. L. Junkins, Y. Kim, Introduction to Dynamics and Control of Flexible "
        "Structures, AIAA 1993, configuration of the hub with four flexible appendages",
        uncertain="quoted at second hand and not compared with the printed table (section and "
        "mass per length give aluminium's 2690 kg/m³, the modulus its 76 GPa); no published "
        "frequency to check against; no damping given, none here",
        damping=SuggestedDamping(
            0.005, "assumed", "its source gives none; half a percent is usual for such structures"
        ),
    ),
    "nrel-5mw-rotor": Entry(
        nrel_5mw_rotor,
        "wind-turbine blade, 49 stations, in the rotor plane",
        source="J. Jonkman, S. Butterfield, W. Musial, G. Scott, Definition of a 5-MW Reference "
        "Wind Turbine for Offshore System Development, NREL/TP-500-38060, 2009, tables 2-1 and 2-2",
        uncertain="pre-twist (13° at the root) and the coupling with flapping are left out; the "
        "mass integrates to 17,609 kg between linear stations, where the report states 17,740; "
        "the shaft is rigid here; the published frequencies are quoted at second hand",
        damping=SuggestedDamping(
            0.00477465, "published", "same report: 0.477465 % of critical in every mode"
        ),
        published=(
            Published(
                "hub-locked",
                ((1, 1.0793),),
                agreement=0.011,
                kind="computed",
                source="same report, table 9-1: first asymmetric edgewise mode of the rotor "
                "on its tower (pitch 1.0793, yaw 1.0898 Hz)",
            ),
        ),
    ),
    "wright-beam": Entry(
        wright_beam,
        "uniform beam, benchmark of spinning blades",
        source="A. D. Wright, C. E. Smith, R. W. Thresher, J. L. C. Wang, Vibration modes of "
        "centrifugally stiffened beams, J. Appl. Mech. 49 (1982); G. Bir, AIAA 2009-1035, table 3a",
        uncertain="nothing: a made-up beam; its length is rounded, which moves frequencies by "
        "1.3e-5",
        damping=SuggestedDamping(0.005, "assumed", _NONE_PUBLISHED),
        published=(
            Published(
                "hub-locked",
                _in_hz(3.516, 22.035, 61.697),
                agreement=4e-5,
                kind="computed",
                source="same table, at rest: 3.516, 22.035 and 61.697 rad/s",
            ),
        ),
    ),
    "harmonic-drive-boom": Entry(
        harmonic_drive_boom,
        "a boom on a harmonic drive: an elastic joint between motor and hub, and a payload",
        source="made up: round numbers of the size that catalogues of motors, strain-wave gears "
        "and aluminium tubes have; no rig has them",
        uncertain="nothing: it is no rig; an example of an elastic joint whose spring is about as "
        "stiff as its beam",
        damping=SuggestedDamping(0.01, "assumed", "a bolted aluminium boom; of no measurement"),
    ),
    "two-wing-satellite": Entry(
        two_wing_satellite,
        "satellite with two wings, from a data sheet of its modes",
        source="made up for this catalogue, in the form of a data sheet",
        uncertain="everything: no such satellite; three modes are given, and those beyond are "
        "not known",
        damping=SuggestedDamping(
            0.005, "assumed", "half a percent of the modes with the hub held is usual for wings"
        ),
    ),
    "ruler-on-servo": Entry(
        ruler_on_servo,
        "steel ruler on a servo, an accelerometer on its way",
        source="made up for this catalogue, from a section and a material",
        uncertain="everything: no such rig; measure your own",
        damping=SuggestedDamping(
            0.01, "assumed", "one percent of the clamped modes, for a ruler screwed to its clamp"
        ),
    ),
    "hodges-pierce-taper": Entry(
        hodges_pierce_taper,
        "linear taper with unit properties",
        source="D. H. Hodges, G. A. Pierce, Introduction to Structural Dynamics and "
        "Aeroelasticity, table 3.14",
        uncertain="nothing: a made-up beam with unit properties and no hub",
        damping=SuggestedDamping(0.005, "assumed", _NONE_PUBLISHED),
        published=(
            Published(
                "hub-locked",
                _in_hz(4.31517, 23.5193, 63.1992),
                agreement=2e-6,
                kind="computed",
                source="same table: 4.31517, 23.5193 and 63.1992 rad/s",
            ),
        ),
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


def damped(name: str) -> Arm:
    """Return the catalogue's arm called `name` with its suggested damping.

    Without damping, a mode that a controller does not know is on the edge of stability.

    Raises
    ------
    InputError
        As `get`.
    """
    return replace(get(name), damping_ratio=CATALOGUE[name].damping.ratio)


def names() -> tuple[str, ...]:
    """Return the names of all catalogue arms."""
    return tuple(CATALOGUE)
