"""A controller that was made elsewhere, so that it is judged like any other."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import wraps
from os import PathLike
from typing import Any

import numpy as np

from slewctl.design.classical.filters import Section, in_series
from slewctl.design.coordinates import balanced
from slewctl.design.own.discretise import discretised
from slewctl.design.own.forms import Law, read_law
from slewctl.design.own.read_file import texts, told_by_file
from slewctl.design.own.sections import read_sections
from slewctl.design.reference import REFERENCE, Reference
from slewctl.design.result import Certificate, Controller
from slewctl.design.stored import reference_of
from slewctl.errors import InputError, check_choice, check_nonnegative, check_positive
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant import GeneralisedPlant, check_plant
from slewctl.plant.sampled import split_delay
from slewctl.plant.signals import ACTUATORS, TORQUE, check_signals

_SIGNS = {"negative": -1.0, "positive": 1.0}


def given(
    system: Any = None,
    *,
    pid: Mapping[str, float] | None = None,
    num: Sequence[float] | None = None,
    den: Sequence[float] | None = None,
    zeros: Sequence[complex] | None = None,
    poles: Sequence[complex] | None = None,
    gain: float | None = None,
    A: Any = None,
    B: Any = None,
    C: Any = None,
    D: Any = None,
    file: str | PathLike[str] | None = None,
    sections: Sequence[Mapping[str, float]] | None = None,
    inputs: Sequence[str] | None = None,
    output: str | None = None,
    feedback: str | None = None,
    sample_time: float | None = None,
    delay: float | None = None,
    discretise: str | None = None,
    prewarp_hz: float | None = None,
) -> Controller:
    """Return a controller that was made elsewhere, so that it is judged like any other.

    Give one form: a system, a PID, polynomials, zeros and poles, matrices, or a file with one
    of them.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction, optional
        From the sensors to the actuator, by name or in the order of `inputs`.
    pid : mapping, optional
        ``kp``, ``ki`` (1/s), ``kd`` (s) and ``filter_hz``, the corner of a first-order lag on
        the derivative: kp + ki/s + kd·s/(1 + s/ω_f).
    num, den : sequence of float, optional
        Polynomials in s, or in z with a `sample_time`, highest power first.
    zeros, poles : sequence of complex, optional
        Roots, in rad/s or of z; complex ones also as pairs [re, im].
    gain : float, optional
        Of gain·Π(s − z)/Π(s − p).
    A, B, C, D : array_like, shapes (n, n), (n, inputs), (1, n), (1, inputs), optional
        Of ẋ = Ax + By, u = Cx + Dy, or x⁺ = … with a `sample_time`; D is zero if left out.
    file : path, optional
        ``.json``, ``.mat`` or ``.npz`` with the names of one of these forms, such as one that
        `Controller.save` wrote.  It is read as data, nothing in it is run.
    sections : sequence of mapping, optional
        Filters behind a continuous law: ``{notch_hz, width, depth}``, ``{lowpass_hz, order}``
        and ``{lead_hz, lead_deg}``.
    inputs : sequence of str, optional
        What the law reads, ``["theta"]`` by default where it reads one signal.  A
        ``theta_ref`` among them is the reference angle of a law with two degrees of freedom;
        without it, the reading of each sensor at the reference is subtracted.
    output : {"torque", "voltage"}, optional
        What the law commands, by default the torque.
    feedback : {"negative", "positive"}, optional
        Whether the law is connected with a minus, as in `control.feedback`, or has it inside.
        A PID has negative feedback unless told otherwise; other forms have no default.  The
        reference's own path keeps its sign.
    sample_time : float, optional
        In s: of a sampled law, or of the computer that will run a continuous one.
    delay : float, optional
        Of a sampled law, in s, from a sample to the output that is computed from it.
    discretise : {"tustin", "zoh", "matched"}, optional
        How a continuous law becomes the one that runs every `sample_time`; that one is judged.
    prewarp_hz : float, optional
        Where ``tustin`` keeps gain and phase exactly.

    Returns
    -------
    Controller
        It promises nothing; closing it around a truth tells what it achieves.

    Raises
    ------
    InputError
        For no form or two, a law that nothing can run, unknown signals, a missing sign, or
        clocks that disagree.

    Examples
    --------
    >>> import slewctl as sc
    >>> K = sc.given(pid={"kp": 20.0, "kd": 9.0, "filter_hz": 30.0})
    >>> K
    <given controller, 1 states, from theta>
    >>> sampled = sc.given(pid={"kp": 20.0, "kd": 9.0, "filter_hz": 30.0},
    ...                    sample_time=0.005, discretise="tustin", delay=0.005)
    >>> sampled.sample_time, sampled.delay
    (0.005, 0.005)
    """
    told = {
        "system": system, "pid": pid, "num": num, "den": den, "zeros": zeros, "poles": poles,
        "gain": gain, "A": A, "B": B, "C": C, "D": D, "sections": sections, "inputs": inputs,
        "output": output, "feedback": feedback, "sample_time": sample_time, "delay": delay,
        "discretise": discretise, "prewarp_hz": prewarp_hz,
    }  # fmt: skip
    options = {key: value for key, value in told.items() if value is not None}
    stored: Mapping[str, Any] = {}
    if file is not None:
        options, stored = told_by_file(file, options)
    law = read_law(options)
    names = _signals(law, options)
    sign = _SIGNS[_feedback(law, options)]
    run = _what_runs(law, options, read_sections(options.get("sections", ())))
    signed = _signed(run, names, sign, _output(law, options))
    measured, reference = _split(signed, names)
    if stored:
        reference = reference_of(stored)
        measured = measured.named(states=texts(stored.get("states", ())) or None)
    late = check_nonnegative(options.get("delay", 0.0), "delay")
    _check_delay(late, measured.sample_time)
    scale = np.asarray(stored.get("state_scale", np.ones(measured.nstates)), dtype=float).ravel()
    return Controller(
        measured,
        str(stored.get("method", "given")),
        {},
        math.nan,
        Certificate(()),
        assumptions=_assumed(options, stored),
        delay=late,
        reference=reference,
        state_scale=scale,
    )


def on_plant(method: Callable[..., Controller]) -> Callable[..., Controller]:
    """Return `given` as a design method: a plant comes first and says which signals there are."""

    @wraps(method)
    def made(plant: GeneralisedPlant, **options: Any) -> Controller:
        check_plant(plant, "design")
        return fitted(method(**options), plant.sensors, plant.actuator)

    return made


def fitted(controller: Controller, sensors: Sequence[str], actuator: str) -> Controller:
    """Return a controller that takes all sensors of a plant, in their order.

    What it does not read of them does not move it.

    Parameters
    ----------
    controller : Controller
    sensors : sequence of str
        All that the plant measures.
    actuator : {"torque", "voltage"}

    Returns
    -------
    Controller

    Raises
    ------
    InputError
        If it reads what is not measured, or commands another actuator.

    Examples
    --------
    >>> K = given(pid={"kp": 20.0})
    >>> fitted(K, ["theta", "root_moment"], "torque").sensors
    ('theta', 'root_moment')
    """
    system = controller.linear
    commanded = system.output_labels[0]
    if commanded != actuator:
        raise InputError(
            f"the controller commands {commanded!r}, the objective limits {actuator!r}",
            where="output",
            remedy="limit what the controller commands",
        )
    if controller.sensors == tuple(sensors):
        return controller
    unknown = [name for name in controller.sensors if name not in sensors]
    if unknown:
        raise InputError(
            f"the controller takes {list(controller.sensors)}, the objective measures "
            f"{list(sensors)}",
            where="inputs",
            remedy=f"add the noise of {' and '.join(unknown)}",
        )
    chosen = np.zeros((len(controller.sensors), len(sensors)))
    for row, name in enumerate(controller.sensors):
        chosen[row, list(sensors).index(name)] = 1.0
    wide = LinearSystem(
        system.A, system.B @ chosen, system.C, system.D @ chosen, system.dt,
        inputs=sensors, outputs=system.output_labels, states=system.state_labels,
        name=system.name,
    )  # fmt: skip
    return replace(controller, system=wide)


def _signals(law: Law, options: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what the law reads, each once."""
    width = law.system.ninputs
    named = options.get("inputs", law.names)
    if named is None and width != 1:
        raise InputError(
            f"the law reads {width} signals", where="inputs", remedy="name them in their order"
        )
    names = (named,) if isinstance(named, str) else tuple(named or ("theta",))
    if law.names and "inputs" in options and sorted(names) != sorted(law.names):
        raise InputError(
            f"the system's own are called {', '.join(law.names)}",
            where="inputs",
            remedy="leave this out, or rename the system's",
        )
    names = law.names or names
    check_signals([name for name in names if name != REFERENCE], "inputs")
    if len(names) != width or len(set(names)) != width:
        raise InputError(
            f"{len(names)} names for {width} signals",
            where="inputs",
            remedy="name each signal that the law reads once",
        )
    return names


def _output(law: Law, options: Mapping[str, Any]) -> str:
    own = law.output or options.get("output", TORQUE)
    if options.get("output", own) != own:
        raise InputError(
            f"the system's own is called {own}",
            where="output",
            remedy="leave this out, or rename the system's",
        )
    return check_choice(own, ACTUATORS, "output")


def _feedback(law: Law, options: Mapping[str, Any]) -> str:
    told = options.get("feedback", "negative" if law.error_driven else None)
    if told is None:
        raise InputError(
            "missing: the sign of this law can be meant both ways",
            where="feedback",
            remedy='give "negative" if it is connected with a minus, as in control.feedback, or '
            '"positive" if its minus is inside',
        )
    return check_choice(told, _SIGNS, "feedback")


def _what_runs(law: Law, options: Mapping[str, Any], sections: Sequence[Section]) -> LinearSystem:
    """Return the law with its filters as it runs: continuous, or on its clock."""
    system = law.system
    if sections and system.sample_time:
        raise InputError(
            "filters are continuous, and the law is sampled",
            where="sections",
            remedy="put them into the law",
        )
    if sections:
        system = series(system, LinearSystem(*in_series(sections)))
    rule = options.get("discretise")
    if rule is None and "prewarp_hz" in options:
        raise InputError(
            "nothing is discretised", where="prewarp_hz", remedy='give discretise = "tustin" too'
        )
    if rule is not None:
        if "sample_time" not in options:
            raise InputError("missing", where="sample_time", remedy="give the clock in s")
        step = check_positive(options["sample_time"], "sample_time")
        system = discretised(system, step, rule, options.get("prewarp_hz"))
    return system if law.kept else balanced(system)[0]


def _signed(system: LinearSystem, names: Sequence[str], sign: float, output: str) -> LinearSystem:
    """Return the law with its minus inside; the path of the reference keeps its sign."""
    if sign < 0:
        factors = np.array([1.0 if name == REFERENCE else -1.0 for name in names])
        B, D = system.B * factors, system.D * factors
    else:
        B, D = system.B, system.D
    return LinearSystem(
        system.A, B, system.C, D, system.dt,
        inputs=names, outputs=[output], states=system.state_labels, name="given",
    )  # fmt: skip


def _split(system: LinearSystem, names: Sequence[str]) -> tuple[LinearSystem, Reference | None]:
    """Return the feedback and, of a law with two degrees of freedom, the reference's path."""
    if REFERENCE not in names:
        return system, None
    at = list(names).index(REFERENCE)
    kept = [k for k in range(len(names)) if k != at]
    if not kept:
        raise InputError(
            "nothing is measured", where="inputs", remedy="name a sensor, such as theta"
        )
    feedback = LinearSystem(
        system.A, system.B[:, kept], system.C, system.D[:, kept], system.dt,
        inputs=[names[k] for k in kept], outputs=system.output_labels,
        states=system.state_labels, name=system.name,
    )  # fmt: skip
    return feedback, Reference(system.B[:, [at]], system.D[:, [at]])


def _check_delay(late: float, sample_time: float) -> None:
    if late and not sample_time:
        raise InputError(
            "a continuous controller has no computational delay",
            where="delay",
            remedy="put the delay into the system, or sample it",
        )
    if sample_time:
        split_delay(sample_time, late)


def _assumed(options: Mapping[str, Any], stored: Mapping[str, Any]) -> tuple[str, ...]:
    source = "read from a file" if stored else "given, not designed: it promises nothing"
    rule = options.get("discretise")
    if rule is None:
        return (source,)
    warped = f", prewarped at {options['prewarp_hz']:g} Hz" if "prewarp_hz" in options else ""
    return (source, f"a continuous law, run every {options['sample_time']:g} s by {rule}{warped}")
