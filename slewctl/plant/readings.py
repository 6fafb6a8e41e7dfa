"""An arm behind its actuator's lags, and the readings behind its sensors'."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slewctl._types import Array
from slewctl.arm import Actuator, Arm, Sensor
from slewctl.errors import InputError
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem

Matrices = tuple[Array, Array, Array, Array]


def driven(arm: LinearSystem, lags: Matrices) -> LinearSystem:
    """Return an arm behind its actuator's lags; their states come after the arm's.

    Parameters
    ----------
    arm : LinearSystem
        With one input.
    lags : tuple of ndarray
        See `slewctl.arm.Actuator.lags`.
    """
    A, B, C, D = lags
    if not len(A):
        return arm
    n = len(arm.A)
    whole = np.block([[arm.A, arm.B @ C], [np.zeros((len(A), n)), A]])
    return LinearSystem(
        whole,
        np.vstack([arm.B @ D, B]),
        np.hstack([arm.C, arm.D @ C]),
        arm.D @ D,
        inputs=arm.input_labels,
        outputs=arm.output_labels,
        states=[*arm.state_labels, *(f"{arm.input_labels[0]}_lag{k + 1}" for k in range(len(A)))],
        name=arm.name,
    )


def measured(plant: LinearSystem, arm: Arm, sensors: Sequence[str]) -> LinearSystem:
    """Return a plant with the last of its outputs read by the arm's sensors.

    Parameters
    ----------
    plant : LinearSystem
        Any inputs; its last outputs are the signals measured, in their order.
    arm : Arm
    sensors : sequence of str
    """
    lags = [arm.sensor(name).lags for name in sensors]
    added = sum(len(own[0]) for own in lags)
    if not added:
        return plant
    n, first = len(plant.A), plant.noutputs - len(sensors)
    A = np.zeros((n + added, n + added))
    B = np.zeros((n + added, plant.ninputs))
    C = np.hstack([plant.C, np.zeros((plant.noutputs, added))])
    D = np.array(plant.D)
    A[:n, :n], B[:n] = plant.A, plant.B
    states, at = list(plant.state_labels), n
    for i, (name, (Ai, Bi, Ci, Di)) in enumerate(zip(sensors, lags, strict=True), start=first):
        here = slice(at, at + len(Ai))
        A[here, :n], A[here, here], B[here] = Bi @ plant.C[i : i + 1], Ai, Bi @ plant.D[i : i + 1]
        C[i, :n], C[i, here] = Di @ plant.C[i : i + 1], Ci
        D[i] = Di @ plant.D[i : i + 1]
        states += [f"{name}_lag{k + 1}" for k in range(len(Ai))]
        at += len(Ai)
    return LinearSystem(
        A,
        B,
        C,
        D,
        inputs=plant.input_labels,
        outputs=plant.output_labels,
        states=states,
        name=plant.name,
    )


def with_lags(controller: LinearSystem, arm: Arm) -> LinearSystem:
    """Return a controller between the lags of an arm's sensors and those of its actuator.

    Around the arm without lags it makes the same loop, and leaves the arm's modes uncoupled.

    Parameters
    ----------
    controller : LinearSystem
        From sensors, by their names, to the actuator.
    arm : Arm
    """
    names = controller.input_labels
    nothing, p = np.zeros((0, 0)), len(names)
    through = LinearSystem(
        nothing, np.zeros((0, p)), np.zeros((p, 0)), np.eye(p), inputs=names, outputs=names
    )
    found = series(measured(through, arm, names), controller)
    drive = arm.drive.lags
    if len(drive[0]):
        found = series(found, LinearSystem(*drive))
    return LinearSystem(*found.matrices, found.dt, inputs=names, outputs=controller.output_labels)


def refuse_lags(arm: Arm, where: str) -> None:
    """Refuse an arm whose actuator or sensors have lags or dead time.

    Parameters
    ----------
    arm : Arm
    where : str
        What cannot take them.

    Raises
    ------
    InputError
    """
    late: dict[str, Actuator | Sensor] = {"actuator": arm.drive}
    late |= {f"sensor of {name}": own for name, own in dict(arm.sensors).items()}
    for name, own in late.items():
        if own.delay or len(own.lags[0]):
            raise InputError(
                f"the {name} has a lag or a dead time, which this does not take into account",
                where=where,
                remedy="ask it of the arm without: dataclasses.replace(arm, actuator=None, "
                "sensors={})",
            )
