"""The keys of a design file, with their types; everything else is refused.

Defaults are those of the classes that the tables describe.  Signs are checked here as well as
there, key by key: a class refuses the first wrong value, a file is told all of them at once.
"""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from slewctl.arm import Hub, Motor, Payload, Rayleigh
from slewctl.compare import Case, Grid

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Efficiency = Annotated[float, Field(gt=0, le=1)]
Count = Annotated[int, Field(ge=1)]
T = TypeVar("T")
# More is no comparison that anybody reads.
Several = Annotated[list[T], Field(max_length=100)]
# Of limits or of noise.
MOST_SIGNALS = 100

# What a design file may say that it is written for.
DESIGN_SCHEMA = "slewctl-design/1"


def _told(unit: str, meaning: str, example: object) -> Any:
    """Return what the reference of design files says of a key.

    Parameters
    ----------
    unit : str
        "1" of a number without one; of what is no number, what it is.
    meaning : str
        A phrase.
    example : object
        A value, as TOML would be read; of a table, one of its keys at least.
    """
    return Field(description=meaning, examples=[example], json_schema_extra={"unit": unit})


class Table(BaseModel):
    """A TOML table that refuses unknown keys and converts nothing."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class BeamTable(Table):
    """``[arm.beam]``.

    A profile is a number, a list of polynomial coefficients in x/L (lowest power first), or
    stations ``{ x = [...], values = [...] }`` with x in metres; the reader checks it.
    """

    length: Annotated[Positive, _told("m", "of the beam", 1.0)]
    mass_per_length: Annotated[
        Any, _told("kg/m", "a number, coefficients in x/L, or stations; not beside a section", 2.0)
    ] = None
    bending_stiffness: Annotated[
        Any, _told("N·m²", "a number, coefficients in x/L, or stations; not beside a section", 40.0)
    ] = None
    section: Annotated[
        dict[str, Any] | None,
        _told(
            "table",
            "a rectangle or a round tube of one material, instead of both",
            {"width": 0.03, "thickness": 0.0015, "youngs_modulus": 2.0e11, "density": 7850.0},
        ),
    ] = None


class RectangleTable(Table):
    """``section`` of ``[arm.beam]`` with a width: a rectangle."""

    width: Annotated[Positive, _told("m", "across the plane of rotation", 0.03)]
    thickness: Annotated[
        Positive, _told("m", "in the plane of rotation: it bends across it", 1.5e-3)
    ]
    youngs_modulus: Annotated[Positive, _told("N/m²", "of the material", 2.0e11)]
    density: Annotated[Positive, _told("kg/m³", "of the material", 7850.0)]


class TubeTable(Table):
    """``section`` of ``[arm.beam]`` with an outer diameter: a round tube, or a rod."""

    outer_diameter: Annotated[Positive, _told("m", "of the tube", 0.04)]
    inner_diameter: Annotated[NonNegative, _told("m", "of its hole", 0.036)] = 0.0
    youngs_modulus: Annotated[Positive, _told("N/m²", "of the material", 7.0e10)]
    density: Annotated[Positive, _told("kg/m³", "of the material", 2700.0)]


class HubTable(Table):
    """``[arm.hub]``."""

    inertia: Annotated[NonNegative, _told("kg·m²", "about the axis", 0.2)] = Hub.inertia
    radius: Annotated[NonNegative, _told("m", "from the axis to the clamp", 0.05)] = Hub.radius
    friction: Annotated[NonNegative, _told("N·m·s/rad", "viscous, of the axis", 0.1)] = Hub.friction


class PayloadTable(Table):
    """``[arm.payload]``."""

    mass: Annotated[NonNegative, _told("kg", "at the tip", 0.1)] = Payload.mass
    inertia: Annotated[NonNegative, _told("kg·m²", "about its own centre", 0.001)] = Payload.inertia


class RayleighTable(Table):
    """``[arm.damping]`` with kind = "rayleigh"."""

    kind: Annotated[str, _told("text", "the law", "rayleigh")]
    alpha: Annotated[NonNegative, _told("1/s", "of the mass matrix", 0.1)] = Rayleigh.alpha
    beta: Annotated[NonNegative, _told("s", "of the stiffness matrix", 1e-4)] = Rayleigh.beta


class KelvinVoigtTable(Table):
    """``[arm.damping]`` with kind = "kelvin-voigt"."""

    kind: Annotated[str, _told("text", "the law", "kelvin-voigt")]
    retardation_time: Annotated[NonNegative, _told("s", "of the beam's material", 1e-4)]


class EncoderTable(Table):
    """A sensor of ``noise`` in ``[controller]`` that is an encoder of the hub's angle."""

    encoder_counts: Annotated[Count, _told("1", "per turn of the hub, after quadrature", 4096)]
    sample_time: Annotated[
        Positive | None,
        _told("s", "that it is read with; by default the controller's own", 0.005),
    ] = None


# Tables whose keys depend on what stands in them, by how the reference calls them.
CHOSEN_TABLES: dict[str, type[Table]] = {
    '`[arm.damping]` with `kind = "rayleigh"`': RayleighTable,
    '`[arm.damping]` with `kind = "kelvin-voigt"`': KelvinVoigtTable,
    "`section` of `[arm.beam]`, a rectangle": RectangleTable,
    "`section` of `[arm.beam]`, a round tube": TubeTable,
    "A sensor of `noise` in `[controller]`, an encoder": EncoderTable,
}


class MotorTable(Table):
    """``[arm.motor]``."""

    resistance: Annotated[Positive, _told("Ω", "of the armature", 2.6)]
    torque_constant: Annotated[Positive, _told("N·m/A", "of the motor's shaft", 0.0077)]
    back_emf_constant: Annotated[NonNegative, _told("V·s/rad", "of the motor's shaft", 0.0077)]
    gear_ratio: Annotated[Positive, _told("1", "turns of the motor for one of the hub", 70.0)] = (
        Motor.gear_ratio
    )
    gear_efficiency: Annotated[Efficiency, _told("1", "from above 0 to 1", 0.9)] = (
        Motor.gear_efficiency
    )
    motor_efficiency: Annotated[Efficiency, _told("1", "from above 0 to 1", 0.69)] = (
        Motor.motor_efficiency
    )
    rotor_inertia: Annotated[NonNegative, _told("kg·m²", "about the motor's shaft", 3.9e-7)] = (
        Motor.rotor_inertia
    )
    torque_limit: Annotated[
        Positive | None,
        _told("N·m", "largest torque on the hub; a slew says whether it passes it", 5.0),
    ] = None
    voltage_limit: Annotated[
        Positive | None, _told("V", "largest voltage; a slew says whether it passes it", 15.0)
    ] = None


class ArmTable(Table):
    """``[arm]``: a catalogue arm, changed where keys are given, or a full description.

    The reader checks the damping ratio (one, or a list) and the table of the damping law,
    whose keys depend on its kind.
    """

    catalogue: Annotated[
        str | None,
        _told(
            "text",
            "an arm of `slewctl arms` to begin with; keys beside it replace its own",
            "paper-beam",
        ),
    ] = None
    name: Annotated[str | None, _told("text", "for tables and reports", "test rig")] = None
    beam: Annotated[
        BeamTable | None,
        _told(
            "table",
            "the beam; needed without a catalogue arm",
            {"length": 1.0, "mass_per_length": 2.0, "bending_stiffness": 40.0},
        ),
    ] = None
    hub: Annotated[
        HubTable | None, _told("table", "what turns and carries the beam", {"inertia": 0.2})
    ] = None
    payload: Annotated[
        PayloadTable | None, _told("table", "what is fixed to the tip", {"mass": 0.1})
    ] = None
    motor: Annotated[
        MotorTable | None,
        _told(
            "table",
            "a DC motor; without one only the torque is known",
            {"resistance": 2.6, "torque_constant": 0.0077, "back_emf_constant": 0.0077},
        ),
    ] = None
    damping: Annotated[
        dict[str, Any] | None,
        _told(
            "table", "a damping law, rayleigh or kelvin-voigt", {"kind": "rayleigh", "beta": 1e-4}
        ),
    ] = None
    damping_ratio: Annotated[
        Any,
        _told(
            "1",
            "ζ of every flexible mode, or a list: the last value holds for all that follow",
            0.005,
        ),
    ] = None


class ModelTable(Table):
    """``[model]``: what the design is made on."""

    basis: Annotated[
        str,
        _told(
            "text",
            "admissible functions: clamped-free, slewing, hub-matched, arm-matched or polynomial",
            "clamped-free",
        ),
    ]
    n: Annotated[Count, _told("1", "number of admissible functions", 2)]


class ControllerTable(Table):
    """``[controller]``: method, weights in physical terms, and the method's own options.

    The case knows the options of its method and refuses what is none.
    """

    model_config = ConfigDict(extra="allow", strict=True, frozen=True)

    method: Annotated[str, _told("text", "the design method; its options stand beside it", "lqg")]
    # Every method but a given law needs both; the reader knows.
    limits: Annotated[
        Annotated[dict[str, Positive], Field(max_length=MOST_SIGNALS)] | None,
        _told(
            "table",
            "largest acceptable value of each signal, in its own unit",
            {"tip": 0.03, "torque": 1.0},
        ),
    ] = None
    noise: Annotated[
        Annotated[dict[str, Positive], Field(max_length=MOST_SIGNALS)] | None,
        _told(
            "table",
            "white noise of the torque and of each sensor, in its own unit per √Hz; or an encoder",
            {"torque": 0.1, "theta": 0.01},
        ),
    ] = None


class SlewTable(Table):
    """``[slew]``: the turn that is simulated."""

    angle_deg: Annotated[Finite, _told("deg", "of the turn", 30.0)]
    duration_s: Annotated[Positive, _told("s", "of the reference", 4.0)]
    horizon_s: Annotated[
        Positive | None,
        _told("s", "how long is simulated; by default three times the duration", 12.0),
    ] = None


class TruthTable(Table):
    """``[truth]``: what the design is judged on."""

    modes: Annotated[Count, _told("1", "flexible modes of the truth", 20)] = Case.truth_modes


class CompareTable(Table):
    """``[compare]``: what the design is compared with."""

    bases: Annotated[
        Several[str],
        _told(
            "list of text", "bases that are tried beside the own one", ["clamped-free", "slewing"]
        ),
    ] = list(Case.bases)
    orders: Annotated[
        Several[Count], _told("list", "numbers of functions that are tried", [1, 2, 3])
    ] = list(Case.orders)


class DesignTable(Table):
    """A whole design file."""

    written_for: Annotated[str, _told("text", "what the file is written for", DESIGN_SCHEMA)] = (
        Field(DESIGN_SCHEMA, alias="schema")
    )
    title: Annotated[str, _told("text", "one line for reports", "A boom with a payload")] = ""
    arm: Annotated[
        ArmTable, _told("table", "the arm", {"catalogue": "paper-beam", "damping_ratio": 0.005})
    ]
    # Needed by every method but a given law; the reader knows.
    model: Annotated[
        ModelTable | None,
        _told("table", "what the design is made on", {"basis": "slewing", "n": 2}),
    ] = None
    controller: Annotated[
        ControllerTable,
        _told(
            "table",
            "the method, its weights and its options",
            {"method": "lqg", "limits": {"torque": 1.0}, "noise": {"torque": 0.1, "theta": 0.01}},
        ),
    ]
    # Needed by what is read from a slew alone; the reader knows.
    slew: Annotated[
        SlewTable | None,
        _told("table", "the turn that is simulated", {"angle_deg": 30.0, "duration_s": 4.0}),
    ] = None
    truth: Annotated[TruthTable, _told("table", "what the design is judged on", {"modes": 20})] = (
        TruthTable()
    )
    compare: Annotated[
        CompareTable, _told("table", "what the design is compared with", {"orders": [1, 2]})
    ] = CompareTable()
    # The check room knows the requirements, and the arm room what can be varied; they refuse
    # what is none.
    requirements: Annotated[
        dict[str, Any], _told("table", "limits to hold, see Requirements", {"gain_margin_db": 6.0})
    ] = {}
    variations: Annotated[
        dict[str, dict[str, Any]],
        _told(
            "tables",
            "other arms to hold them on, by name: keys of `slewctl.vary`",
            {"heavy": {"payload_mass": 0.2}},
        ),
    ] = {}


class GridTable(Table):
    """``[[grid]]``: the values of each axis; every combination is tried."""

    bases: Annotated[
        list[str],
        _told("list of text", "bases, or reductions of the truth", ["clamped-free", "slewing"]),
    ] = list(Grid.bases)
    orders: Annotated[list[Count], _told("list", "numbers of functions", [1, 2, 3])] = list(
        Grid.orders
    )
    methods: Annotated[list[str], _told("list of text", "design methods", ["lqg"])] = list(
        Grid.methods
    )
    hub_ratios: Annotated[
        list[NonNegative], _told("list", "hub inertia over that of the beam", [0.0, 1.0])
    ] = list(Grid.hub_ratios)
    payload_ratios: Annotated[
        list[NonNegative], _told("list", "payload mass over that of the beam", [0.0, 0.5])
    ] = list(Grid.payload_ratios)
    damping_ratios: Annotated[
        list[NonNegative], _told("list", "ζ of every flexible mode", [0.005])
    ] = list(Grid.damping_ratios)
    bandwidths: Annotated[
        list[Positive],
        _told("list", "of the rigid arm under LQR, over the first flexible frequency", [0.3, 1.0]),
    ] = list(Grid.bandwidths)
    sensors: Annotated[
        list[list[str]], _told("list of lists of text", "sets of sensors", [["theta", "theta_dot"]])
    ] = [list(names) for names in Grid.sensors]


class StudyTable(Table):
    """A whole study file."""

    title: Annotated[str, _told("text", "one line for reports", "A boom with a payload")] = ""
    arm: Annotated[
        ArmTable, _told("table", "the arm", {"catalogue": "paper-beam", "damping_ratio": 0.005})
    ]
    truth: Annotated[TruthTable, _told("table", "what the design is judged on", {"modes": 20})] = (
        TruthTable()
    )
    grid: Annotated[
        list[GridTable], _told("tables", "values of each axis, all combined", [{"orders": [1, 2]}])
    ]
