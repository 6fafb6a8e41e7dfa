"""The data sheet of a beam: what a finite-element code would tell of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from slewctl.arm import Arm, Hub, ModalData, Payload, Place
from slewctl.errors import InputError
from slewctl.model.assembly import assemble, check_arm, tip_signs
from slewctl.model.converge import check_modes, converged


def modal_data(arm: Arm, modes: int) -> Arm:
    """Return an arm known by the hub-locked modes of another, which has a beam.

    Its places are the beam's ``tip`` and ``root``.  Stacked with others it is one of several
    unequal appendages; by itself it is the arm cut off after so many of its hub-locked modes.

    Parameters
    ----------
    arm : Arm
        Without drag; its damping ratios are those of hub-locked modes, or all zero.
    modes : int
        How many hub-locked modes to keep.

    Returns
    -------
    Arm
        With the hub's friction and motor, the hub's own inertia apart from the data's.

    Raises
    ------
    InputError
        For an arm that is made of modal data already, with drag, or with damping ratios of its
        free modes.

    Examples
    --------
    >>> import slewctl as sc
    >>> sheet = sc.modal_data(sc.Arm(sc.Beam(1.0, 1.0, 1.0), sc.Hub(0.5)), 3)
    >>> print(sc.truth(sheet))
    truth of arm: its 3 modes as given, to 9.83 Hz
    """
    check_arm(arm, "modal_data")
    count = check_modes(modes, "modal_data.modes")
    if arm.damping_modes == "free" and np.any(arm.damping_ratio):
        raise InputError(
            "the damping ratios are those of the free modes",
            where="modal_data",
            remedy='give those of the hub-locked ones (damping_modes="hub-locked")',
        )
    found = converged(arm, count, "hub-locked")
    rigid = replace(arm, damping=None, damping_ratio=0.0, joint=None)
    model = assemble(rigid, found.basis)
    shapes = found.shapes * tip_signs(found.basis, found.shapes)
    tip = model.displacement(np.array([arm.beam.length]))[0, 1:] @ shapes
    bent = found.basis.evaluate(np.zeros(1), 2)[0] @ shapes / arm.beam.length**2
    stiffness = float(arm.beam.stiffness_profile(np.zeros(1))[0])
    data = ModalData(
        float(model.mass[0, 0]) - rigid.hub_inertia,
        tuple((found.omega / (2 * math.pi)).tolist()),
        tuple((model.mass[0, 1:] @ shapes).tolist()),
        (
            Place("tip", arm.reach, tuple(tip.tolist())),
            Place("root", moments=tuple((stiffness * bent).tolist())),
        ),
    )
    hub = Hub(arm.hub.inertia, friction=arm.hub.friction)
    return replace(
        arm, beam=data, hub=hub, payload=Payload(), masses=(), damping_modes="hub-locked"
    )
