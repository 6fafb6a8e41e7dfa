"""Margins of what a user has: a loop of this toolbox, a return ratio, or its two parts."""

from __future__ import annotations

from typing import TypeAlias

import control
import numpy as np

from slewctl._types import ComplexArray
from slewctl.design import Controller
from slewctl.errors import InputError, check_nonnegative, shown
from slewctl.loop.broken import BrokenLoop
from slewctl.loop.closed import Loop, UnstableLoopError
from slewctl.loop.hybrid import HybridDelay, delayed_loop, fastest_that_matters, smallest_delay
from slewctl.loop.margins import Margins, check_single, classical_margins
from slewctl.loop.naming import Modes, modes_of
from slewctl.loop.sampled import SampledLoop
from slewctl.plant import GeneralisedPlant

System: TypeAlias = control.StateSpace | control.TransferFunction
# A pole that neither input nor output of L reaches by more than this, relative, is hidden.
_HIDDEN = 1e-9


def margins(
    plant: Loop | GeneralisedPlant | System,
    controller: Controller | System | float | None = None,
    *,
    skew: float = 0.0,
    delay: float = 0.0,
) -> Margins:
    """Return the exact margins of a single loop, continuous or sampled.

    Stability comes first, of every state of plant and controller: a loop in which an
    unstable pole is cancelled has no margins however well its return ratio looks.

    **Signs.**  python-control systems are connected by *negative* feedback: L = plant ·
    controller, stability means 1 + L ≠ 0.  A slewctl `Controller` has its minus inside and is
    connected with a *plus* sign: L = −K·G.

    Parameters
    ----------
    plant : Loop, GeneralisedPlant, control.StateSpace or control.TransferFunction
        A closed `Loop`, or, without a controller, the return ratio L; else the plant, with
        one input, at which the loop is broken, and as many outputs as the controller reads.
    controller : Controller, control.StateSpace, control.TransferFunction or float, optional
        With a sample time and a continuous plant, the plant is sampled exactly with a
        zero-order hold.  The margins are then those at the hold, exact for the hybrid loop
        as far as gain and phase there are concerned; for the delay of the continuous
        signal see `hybrid_delay_margin`.
    skew : float
        σ of the disk margin (Seiler, Packard and Gahinet 2020); zero is balanced.
    delay : float
        In s, of a sampled controller: from the sample to the input computed from it.  A
        `Controller` brings its own.

    Returns
    -------
    Margins

    Raises
    ------
    UnstableLoopError
        An unstable loop has no margin; the poles are named, and hidden ones called so.
    InputError
        For several inputs, unlike or unknown sample times, 1 + D = 0, or an improper system.
    """
    if isinstance(plant, Loop):
        if controller is not None:
            raise InputError(
                "a loop has its controller already", where="margins", remedy="give the loop alone"
            )
        plant.require_stable("margins")
        if skew == 0:
            return plant.margins
        hertz = tuple(float(f) for f in plant.model.frequencies_hz)
        return classical_margins(plant.return_ratio, skew=skew, modes=Modes(hertz, rigid=True))
    G = _state_space(plant, "plant")
    if controller is None:
        loop, named = G, None
    else:
        loop, named = _return_ratio(G, controller, delay), _modes(G)
    _require_stable(loop)
    return classical_margins(loop, skew=skew, modes=named)


def hybrid_delay_margin(
    plant: SampledLoop | GeneralisedPlant | System,
    controller: Controller | System | None = None,
    *,
    delay: float = 0.0,
) -> HybridDelay:
    """Return the delay that a sampled controller's loop around a continuous plant stands.

    The delay may be any fraction of a sample; it acts on the continuous signal into the
    plant, and changes the sampled plant.  See `smallest_delay` for what is guaranteed.

    Parameters
    ----------
    plant : SampledLoop, GeneralisedPlant, control.StateSpace or control.TransferFunction
        A closed sampled loop, or a continuous plant with one input.
    controller : Controller, control.StateSpace or control.TransferFunction, optional
        Sampled; signs as in `margins`.
    delay : float
        In s, that the loop has already.  A `Controller` brings its own.

    Raises
    ------
    UnstableLoopError
        If the loop is unstable without additional delay.
    InputError
        If the plant is not continuous or the controller not sampled.
    """
    if isinstance(plant, SampledLoop):
        controller = plant.controller
        plant = plant.plant
    if controller is None:
        raise InputError(
            "there is no controller",
            where="hybrid_delay_margin",
            remedy="give a SampledLoop, or a continuous plant and a sampled controller",
        )
    G = _state_space(plant, "plant")
    K, late = _negative_feedback(controller, delay, G)
    if not K.dt or G.dt:
        raise InputError(
            "this wants a continuous plant and a sampled controller",
            where="hybrid_delay_margin",
            remedy="for one clock alone, margins(...).delay_s is exact",
        )
    with_delay = delayed_loop(G, K, late)
    nominal = with_delay(0.0)
    _require_stable(nominal)
    return smallest_delay(with_delay, float(K.dt), fastest_that_matters(G, nominal))


def _state_space(system: object, where: str) -> control.StateSpace:
    """Return a system as a state space, its sample time known."""
    if isinstance(system, GeneralisedPlant):
        return system.control_path
    if isinstance(system, control.TransferFunction):
        system = _realised(system, where)
    if not isinstance(system, control.StateSpace):
        raise InputError(
            f"{shown(system)} is no state-space system or transfer function",
            where=where,
            remedy="give a control.StateSpace or control.TransferFunction",
        )
    if system.dt is True:
        raise InputError(
            "its sample time is not known", where=where, remedy="give it in seconds, as dt"
        )
    if not all(np.all(np.isfinite(getattr(system, name))) for name in "ABCD"):
        raise InputError("it has entries that are not finite", where=where, remedy="mend them")
    return system


def _realised(system: control.TransferFunction, where: str) -> control.StateSpace:
    if system.ninputs != 1 or system.noutputs != 1:
        raise InputError(
            "a transfer function with several inputs or outputs",
            where=where,
            remedy="give a control.StateSpace",
        )
    up, down = (np.trim_zeros(np.atleast_1d(p[0][0]), "f") for p in (system.num, system.den))
    if len(up) > len(down):
        raise InputError(
            "more zeros than poles: it has no state space",
            where=where,
            remedy="add poles above the frequencies of interest",
        )
    if not len(up):
        return control.StateSpace([], [], [], [[0.0]], system.dt)
    return control.tf2ss(system)


def _negative_feedback(
    controller: Controller | System | float, delay: float, plant: control.StateSpace
) -> tuple[control.StateSpace, float]:
    """Return K for negative feedback, reading the plant's outputs, and its delay in s."""
    late = check_nonnegative(delay, "delay")
    if isinstance(controller, Controller):
        system, sign, late = controller.system, -1.0, late + controller.delay
        plain = _state_space(system, "controller")
        K = control.StateSpace(plain.A, plain.B, sign * plain.C, sign * plain.D, plain.dt)
    elif isinstance(controller, (int, float)) and not isinstance(controller, bool):
        K = control.StateSpace([], [], [], [[float(controller)]], plant.dt)
    else:
        K = _state_space(controller, "controller")
    if plant.ninputs != 1 or K.noutputs != 1 or K.ninputs != plant.noutputs:
        raise InputError(
            f"a plant of {plant.ninputs} inputs and {plant.noutputs} outputs under a controller "
            f"of {K.ninputs} inputs and {K.noutputs} outputs",
            where="margins",
            remedy="break one loop at the plant's only input, or use multiloop_margins",
        )
    if isinstance(controller, Controller):
        K = _in_order(K, controller.sensors, plant)
    return K, late


def _in_order(
    K: control.StateSpace, sensors: tuple[str, ...], plant: control.StateSpace
) -> control.StateSpace:
    """Return K with its inputs in the order of the plant's outputs, where those are named."""
    names = list(plant.output_labels)
    if set(names) != set(sensors):
        return K
    order = [sensors.index(name) for name in names]
    return control.StateSpace(K.A, K.B[:, order], K.C, K.D[:, order], K.dt)


def _return_ratio(
    G: control.StateSpace, controller: Controller | System | float, delay: float
) -> control.StateSpace:
    """Return L = K·G, broken at the plant's input, with every state of both."""
    K, late = _negative_feedback(controller, delay, G)
    if K.dt and not G.dt:
        return delayed_loop(G, K, late)(0.0)
    if late:
        raise InputError(
            "only a sampled controller of a continuous plant has a delay of its own",
            where="delay",
            remedy="put the delay into the plant, or compare margins.delay_s with it",
        )
    if float(G.dt or 0) != float(K.dt or 0):
        raise InputError(
            f"the plant has sample time {float(G.dt or 0):g} s, the controller "
            f"{float(K.dt or 0):g} s",
            where="margins",
            remedy="sample both alike; a continuous plant is sampled here, exactly",
        )
    A = np.block([[G.A, np.zeros((G.nstates, K.nstates))], [K.B @ G.C, K.A]])
    return control.StateSpace(
        A, np.vstack([G.B, K.B @ G.D]), np.hstack([K.D @ G.C, K.C]), K.D @ G.D, G.dt
    )


def _modes(plant: control.StateSpace) -> Modes:
    poles = np.linalg.eigvals(np.asarray(plant.A, dtype=float)).astype(complex)
    return modes_of(poles - (1 if plant.dt else 0), float(plant.dt or 0))


def _require_stable(loop: control.StateSpace) -> None:
    """Raise `UnstableLoopError` with the poles that are not stable, and which are hidden."""
    check_single(loop)
    broken = BrokenLoop(loop)
    if 1 + broken.D == 0 or not broken.unstable(1.0)[1]:
        return  # 1 + D = 0 is refused in its own words
    poles = broken.poles
    growth = broken.growth(poles)
    bad = poles[(growth >= min(0.0, float(growth.max()))) & (poles.imag >= 0)]
    hidden = [pole for pole in bad if _hidden(broken, pole)]
    remedy = "change the design; the loop's poles say where it fails"
    what = f"the closed loop is not stable: {_listed(broken, bad)}"
    if hidden:
        what += (
            f"; {_listed(broken, np.array(hidden))} is hidden: plant and controller cancel it, "
            "so that it does not show in L and no feedback moves it"
        )
        remedy = "do not cancel poles that are not stable"
    raise UnstableLoopError(what, where="margins", remedy=remedy)


def _hidden(loop: BrokenLoop, pole: complex) -> bool:
    """Whether input or output of L does not reach a pole (Popov–Belevitch–Hautus)."""
    size = max(float(np.linalg.norm(loop.A, 2)), float(np.finfo(float).tiny))
    shifted = (loop.A - pole * np.eye(len(loop.A))) / size
    b = loop.B / (np.linalg.norm(loop.B) or 1.0)
    c = loop.C / (np.linalg.norm(loop.C) or 1.0)
    reach = [
        np.linalg.svd(np.hstack([shifted, b]), compute_uv=False)[-1],
        np.linalg.svd(np.vstack([shifted, c]), compute_uv=False)[-1],
    ]
    return bool(min(reach) < _HIDDEN)


def _listed(loop: BrokenLoop, poles: ComplexArray) -> str:
    """Return at most three poles in words: s in rad/s, or z."""
    letter, shift, unit = ("z", 1.0, "") if loop.step else ("s", 0.0, " rad/s")
    ordered = poles[np.argsort(-loop.growth(poles))]
    names = []
    for pole in ordered[:3] + shift:
        turning = f" ± {pole.imag:.4g}j" if pole.imag else ""
        names.append(f"{letter} = {pole.real:.4g}{turning}{unit}")
    more = f" and {len(poles) - 3} more" if len(poles) > 3 else ""
    return ("pole " if len(poles) == 1 else "poles ") + ", ".join(names) + more
