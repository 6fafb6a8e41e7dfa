"""The keys of a design file, with their types; everything else is refused.

Defaults are those of the classes that the tables describe.  Signs are checked here as well as
there, key by key: a class refuses the first wrong value, a file is told all of them at once.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict, Field

from slewctl.arm import Hub, LumpedMass, Motor, Payload
from slewctl.compare import Case
from slewctl.files.drive_tables import ActuatorTable, JointTable, SensorTable
from slewctl.files.export_table import ExportTable
from slewctl.files.measured_table import MeasuredTable
from slewctl.files.modal_schema import ModalDataTable, WingTable
from slewctl.files.slew_table import SlewTable
from slewctl.files.table import Count, Efficiency, Finite, NonNegative, Positive, Several, Table
from slewctl.files.table import told as _told

# Of limits or of noise.
MOST_SIGNALS = 100

# What a design file may say that it is written for.
DESIGN_SCHEMA = "slewctl-design/1"


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


class HubTable(Table):
    """``[arm.hub]``."""

    inertia: Annotated[NonNegative, _told("kg·m²", "about the axis", 0.2)] = Hub.inertia
    radius: Annotated[NonNegative, _told("m", "from the axis to the clamp", 0.05)] = Hub.radius
    friction: Annotated[NonNegative, _told("N·m·s/rad", "viscous, of the axis", 0.1)] = Hub.friction


class PayloadTable(Table):
    """``[arm.payload]``."""

    mass: Annotated[NonNegative, _told("kg", "at the tip", 0.1)] = Payload.mass
    inertia: Annotated[NonNegative, _told("kg·m²", "about its own centre", 0.001)] = Payload.inertia


class LumpedMassTable(Table):
    """``[[arm.masses]]``."""

    x: Annotated[NonNegative, _told("m", "from the clamp", 0.3)]
    mass: Annotated[NonNegative, _told("kg", "fixed to the beam there", 0.05)] = LumpedMass.mass
    inertia: Annotated[NonNegative, _told("kg·m²", "about its own centre", 1e-5)] = (
        LumpedMass.inertia
    )


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
    modal_data: Annotated[
        ModalDataTable | None,
        _told(
            "table",
            "the modes with the hub held, of a data sheet, instead of a beam",
            {"inertia": 600.0, "frequencies_hz": [0.2, 1.3], "coupling": [20.0, 4.0]},
        ),
    ] = None
    wings: Annotated[
        dict[str, WingTable] | None,
        _told(
            "tables",
            "unequal appendages by name, each with modal data of its own",
            {"left": {"inertia": 300.0, "frequencies_hz": [0.2], "coupling": [14.0]}},
        ),
    ] = None
    appendages: Annotated[
        Count | None,
        _told("1", "equal ones on the hub: beam, payload and data are those of one", 2),
    ] = None
    hub: Annotated[
        HubTable | None, _told("table", "what turns and carries the beam", {"inertia": 0.2})
    ] = None
    payload: Annotated[
        PayloadTable | None, _told("table", "what is fixed to the tip", {"mass": 0.1})
    ] = None
    masses: Annotated[
        Several[LumpedMassTable] | None,
        _told("tables", "rigid bodies fixed along the beam", [{"x": 0.3, "mass": 0.05}]),
    ] = None
    motor: Annotated[
        MotorTable | None,
        _told(
            "table",
            "a DC motor; without one only the torque is known",
            {"resistance": 2.6, "torque_constant": 0.0077, "back_emf_constant": 0.0077},
        ),
    ] = None
    joint: Annotated[
        JointTable | None,
        _told(
            "table",
            "an elastic joint between the rotor and the hub",
            {"stiffness": 100.0, "rotor_inertia": 0.01},
        ),
    ] = None
    actuator: Annotated[
        ActuatorTable | None,
        _told("table", "lag, dead time and torque limit of the drive", {"lag": 0.002}),
    ] = None
    sensors: Annotated[
        dict[str, SensorTable] | None,
        _told("tables", "lag and dead time of signals, by name", {"theta": {"lag": 0.001}}),
    ] = None
    damping: Annotated[
        dict[str, Any] | None,
        _told(
            "table",
            "a damping law: rayleigh, kelvin-voigt or drag",
            {"kind": "rayleigh", "beta": 1e-4},
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
    damping_modes: Annotated[
        str | None,
        _told(
            "text",
            "whose modes have these ratios: free (the default) or hub-locked",
            "hub-locked",
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


class UncertaintyTable(Table):
    """``[uncertainty]``: the box in which `slewctl worst` and the gate look for the worst arm."""

    box: Annotated[
        dict[str, list[Finite]],
        _told(
            "table",
            "lowest and highest value of each uncertain property: keys of `slewctl.vary`",
            {"payload_mass": [0.0, 0.2], "stiffness_factor": [0.9, 1.1]},
        ),
    ]
    quantity: Annotated[
        str, _told("text", "what is to be good on the worst arm, see Requirements", "disk_margin")
    ] = "disk_margin"
    samples: Annotated[
        Annotated[int, Field(ge=0)], _told("1", "arms inside of the box, beside its corners", 32)
    ] = 32
    searches: Annotated[
        Annotated[int, Field(ge=0)], _told("1", "searches from the worst arms so far", 2)
    ] = 2
    evaluations: Annotated[
        Count | None, _told("1", "most arms of each search; 60 by default", 60)
    ] = None
    seed: Annotated[
        Annotated[int, Field(ge=0)] | None, _told("1", "of the samples; 0 by default", 0)
    ] = None


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
    uncertainty: Annotated[
        UncertaintyTable | None,
        _told(
            "table",
            "a box of the arm's properties; the requirements hold on its worst arm too",
            {"box": {"payload_mass": [0.0, 0.2]}},
        ),
    ] = None
    measured: Annotated[
        MeasuredTable | None,
        _told("table", "a measured response to hold them on too", {"file": "response.csv"}),
    ] = None
    export: Annotated[
        ExportTable | None,
        _told("table", "how the controller runs, as code", {"arithmetic": "float"}),
    ] = None
