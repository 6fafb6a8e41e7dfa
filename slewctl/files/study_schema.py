"""The keys of a study file, with their types; everything else is refused."""

from __future__ import annotations

from typing import Annotated

from slewctl.compare import Grid
from slewctl.files.schema import ArmTable, TruthTable
from slewctl.files.table import Count, Finite, NonNegative, Positive, Table, told


class GridTable(Table):
    """``[[grid]]``: the values of each axis; every combination is tried."""

    bases: Annotated[
        list[str],
        told("list of text", "bases, or reductions of the truth", ["clamped-free", "slewing"]),
    ] = list(Grid.bases)
    orders: Annotated[list[Count], told("list", "numbers of functions", [1, 2, 3])] = list(
        Grid.orders
    )
    methods: Annotated[list[str], told("list of text", "design methods", ["lqg"])] = list(
        Grid.methods
    )
    hub_ratios: Annotated[
        list[NonNegative], told("list", "hub inertia over that of the beam", [0.0, 1.0])
    ] = list(Grid.hub_ratios)
    payload_ratios: Annotated[
        list[NonNegative], told("list", "payload mass over that of the beam", [0.0, 0.5])
    ] = list(Grid.payload_ratios)
    damping_ratios: Annotated[
        list[NonNegative], told("list", "ζ of every flexible mode", [0.005])
    ] = list(Grid.damping_ratios)
    bandwidths: Annotated[
        list[Positive],
        told("list", "of the rigid arm under LQR, over the first flexible frequency", [0.3, 1.0]),
    ] = list(Grid.bandwidths)
    sensors: Annotated[
        list[list[str]], told("list of lists of text", "sets of sensors", [["theta", "theta_dot"]])
    ] = [list(names) for names in Grid.sensors]
    variations: Annotated[
        list[dict[str, Finite]] | None,
        told(
            "list of tables",
            "what else is changed of the arm, by the keys of [variations], in SI units; {} for "
            "the arm as it is",
            [{}, {"actuator_delay": 0.002}],
        ),
    ] = None


class StudyTable(Table):
    """A whole study file."""

    title: Annotated[str, told("text", "one line for reports", "A boom with a payload")] = ""
    arm: Annotated[
        ArmTable, told("table", "the arm", {"catalogue": "paper-beam", "damping_ratio": 0.005})
    ]
    truth: Annotated[TruthTable, told("table", "what the design is judged on", {"modes": 20})] = (
        TruthTable()
    )
    grid: Annotated[
        list[GridTable], told("tables", "values of each axis, all combined", [{"orders": [1, 2]}])
    ]
