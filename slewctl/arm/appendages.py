"""Several flexible appendages on one hub: equal ones as one, unequal ones side by side."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from slewctl.arm.beam import Beam
from slewctl.arm.damping import Drag
from slewctl.arm.hub import Hub
from slewctl.arm.masses import Payload
from slewctl.arm.modal_data import ModalData, Place
from slewctl.arm.motor import Motor
from slewctl.arm.parts import Arm
from slewctl.arm.variation import scaled
from slewctl.errors import InputError, check_count, shown


def equal_appendages(arm: Arm, count: int) -> Arm:
    """Return an arm with `count` appendages like the one that it has, on the same hub.

    Turning the hub drives the motion in which all of them bend alike: it is that of one with
    `count` times the mass, stiffness, payload, lumped masses and drag.  The motions in which
    they bend against each other leave the hub at rest and are not in the model.  The root
    moment is then that of all together.

    Parameters
    ----------
    arm : Arm
        With one of them; its hub is the whole hub.  Of an arm from modal data the inertia
        must be that of the appendage alone, and the hub's its own.
    count : int

    Returns
    -------
    Arm

    Raises
    ------
    InputError
        If there is not one at least.

    Examples
    --------
    >>> import slewctl as sc
    >>> panel = sc.Arm(sc.Beam(1.0, 2.0, 1.0), sc.Hub(1.0), damping=sc.Drag(2.0))
    >>> both = sc.equal_appendages(panel, 2)
    >>> both.beam.mass_per_length, both.beam.bending_stiffness, both.damping, both.hub.inertia
    (4.0, 2.0, Drag(per_length=4.0), 1.0)
    """
    n = check_count(count, "appendages")
    beam = arm.beam
    if isinstance(beam, ModalData):
        return replace(arm, beam=_equal_data(beam, n))
    drag = arm.damping.scaled(n) if isinstance(arm.damping, Drag) else arm.damping
    return replace(
        arm,
        beam=Beam(beam.length, scaled(beam.mass_per_length, n), scaled(beam.bending_stiffness, n)),
        payload=Payload(n * arm.payload.mass, n * arm.payload.inertia),
        masses=tuple(mass.scaled(n) for mass in arm.masses),
        damping=drag,
    )


def _equal_data(data: ModalData, n: int) -> ModalData:
    """Return the modes in which n structures bend alike, each with 1/√n of the coordinate."""

    def shared(values: Sequence[float] | None, factor: float) -> tuple[float, ...] | None:
        return None if values is None else tuple(factor * value for value in values)

    places = tuple(
        Place(p.name, p.lever, shared(p.shapes, 1 / math.sqrt(n)), shared(p.moments, math.sqrt(n)))
        for p in data.places
    )
    found = data.scaled(coupling=math.sqrt(n), inertia=n)
    return replace(found, places=places)


def stacked_appendages(
    appendages: Mapping[str, Arm],
    hub: Hub | None = None,
    *,
    motor: Motor | None = None,
    name: str = "arm",
) -> Arm:
    """Return an arm that carries unequal appendages, each known by its modes with the hub held.

    Inertias add, the modes stand side by side, ordered by frequency with their couplings and
    damping ratios, and each place gets the name of its appendage before its own: the tip of
    ``left`` is ``left_tip``, and is measured as ``deflection@left_tip``.

    Parameters
    ----------
    appendages : mapping of str to Arm
        From modal data, each with the inertia of the appendage alone and without a hub.
    hub : Hub, optional
        That carries them all.
    motor : Motor, optional
    name : str

    Returns
    -------
    Arm

    Raises
    ------
    InputError
        For an appendage that has a beam, a hub, a drive or sensors of its own, ratios of the free
        arm or a damping law.

    Examples
    --------
    >>> import slewctl as sc
    >>> long = sc.Arm(sc.ModalData(300.0, (0.2, 1.3), (14.0, 3.0)), damping_ratio=0.005)
    >>> short = sc.Arm(sc.ModalData(40.0, (0.9,), (6.0,)), damping_ratio=0.01)
    >>> both = sc.stacked_appendages({"long": long, "short": short}, sc.Hub(200.0))
    >>> both.beam.frequencies_hz, both.damping_ratio
    ((0.2, 0.9, 1.3), (0.005, 0.01, 0.005))
    """
    known = {key: _data_of(key, each) for key, each in appendages.items()}
    modes: list[tuple[float, float, float, str, int]] = []
    for key, data in known.items():
        ratios = appendages[key].damping_ratios(data.modes)
        columns = zip(data.frequencies_hz, data.coupling, ratios.tolist(), strict=True)
        modes += [(*column, key, k) for k, column in enumerate(columns)]
    if not modes:
        raise InputError("there is no appendage", where="appendages", remedy="give one at least")
    modes.sort(key=lambda mode: mode[0])
    places: list[Place] = []
    for key, data in known.items():
        kept = [k if owner == key else None for *_, owner, k in modes]
        places += [place.renamed(key, kept) for place in data.places]
    frequencies, couplings, damping, _, _ = zip(*modes, strict=True)
    whole = ModalData(
        sum(data.inertia for data in known.values()),
        frequencies,
        couplings,
        tuple(places),
    )
    return Arm(whole, hub or Hub(), damping_ratio=damping, motor=motor, name=name)


def _data_of(key: str, arm: object) -> ModalData:
    """Return the data of one appendage; refuse what belongs to the whole arm."""
    where = f"appendages.{key}"
    if not isinstance(arm, Arm) or not isinstance(arm.beam, ModalData):
        raise InputError(
            f"{shown(arm)} is not an arm from modal data",
            where=where,
            remedy="give the modes of the appendage with the hub held, as sc.modal_data makes "
            "them of a beam",
        )
    own = (arm.motor, arm.damping, arm.joint, arm.actuator, arm.sensors or None)
    if arm.hub != Hub() or any(part is not None for part in own):
        raise InputError(
            "it has a hub, a drive, sensors or a damping law of its own",
            where=where,
            remedy="leave them out: the hub that carries all is given once",
        )
    if arm.damping_modes != "hub-locked":
        raise InputError(
            "its damping ratios are those of its free modes, which the others change",
            where=where,
            remedy="give those of the hub-locked modes",
        )
    return arm.beam
