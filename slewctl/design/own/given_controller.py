"""A controller that was made elsewhere, so that it is judged like any other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slewctl._types import FilePath
from slewctl.design.classical.filters import Section, in_series
from slewctl.design.coordinates import balanced
from slewctl.design.discretise import check_rule, discretised
from slewctl.design.own.forms import Law, find_form, read_law
from slewctl.design.own.law_signals import output_of, reference_apart, sign_of, signals_of, signed
from slewctl.design.own.read_file import texts, told_by_file
from slewctl.design.own.sections import read_sections
from slewctl.design.reference import Reference
from slewctl.design.result import Certificate, Controller
from slewctl.design.stored import arithmetic_of, entry_of, reference_of
from slewctl.errors import (
    Faults,
    InputError,
    SlewctlError,
    check_nonnegative,
    check_positive,
    faults_of,
)
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.sampled import split_delay
from slewctl.plant.signals import TORQUE

# Stands in for a clock that is missing, so that the rest is looked at: any frequency is below it.
_NO_CLOCK = 1e-9


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
    file: FilePath | None = None,
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
        What the law commands, by default the torque; in a design file, what limits or an arm
        without a motor leave no doubt of.
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
    return read_options(options if file is None else {**options, "file": file})


def read_options(options: Mapping[str, Any], actuator: str | None = TORQUE) -> Controller:
    """Return what the options of `given` tell; all that is wrong with them is told at once.

    Parameters
    ----------
    options : mapping of str to object
    actuator : {"torque", "voltage"} or None
        What it commands where nothing says so; None if something must.
    """
    faults = Faults()
    file = options.get("file")
    options = {key: value for key, value in options.items() if key != "file"}
    held: Mapping[str, Any] = {}
    stored: Mapping[str, Any] = {}
    if file is not None:
        held, stored = faults.attempt(told_by_file, file, options) or ({}, {})
    try:
        law = _read({**options, **held}, actuator, faults, unread=bool(faults))
    except InputError as error:
        placed = Faults()
        placed.add(_placed(fault, held, file) for fault in faults_of(error))
        placed.tell()
        raise
    run, reference = law.run, law.reference
    if stored:
        reference = reference_of(stored)
        run = run.named(states=texts(stored.get("states", ())) or None)
    scale = np.asarray(stored.get("state_scale", np.ones(run.nstates)), dtype=float).ravel()
    return Controller(
        run,
        str(stored.get("method", "given")),
        {},
        math.nan,
        Certificate(()),
        assumptions=_assumed({**options, **held}, stored),
        delay=law.delay,
        reference=reference,
        state_scale=scale,
        entry=entry_of(stored, run.nstates),
        arithmetic=arithmetic_of(stored, run),
        continuous=None
        if law.continuous is None
        else Controller(law.continuous, "given", {}, math.nan, Certificate(())),
    )


@dataclass(frozen=True, eq=False)
class _Law:
    """A law as it runs: with its minus inside, and without the path of the reference."""

    run: LinearSystem
    reference: Reference | None
    delay: float
    continuous: LinearSystem | None


def _read(
    options: Mapping[str, Any], actuator: str | None, faults: Faults, *, unread: bool
) -> _Law:
    """Return the law that options tell; of one whose file is unread the rest is looked at."""
    form = None if unread else faults.attempt(find_form, options)
    law = None if form is None else faults.attempt(read_law, form, options)
    sign = faults.attempt(sign_of, form, options)
    names = faults.attempt(signals_of, law, options)
    output = faults.attempt(output_of, law, options, TORQUE if unread else actuator)
    sections = faults.attempt(read_sections, options.get("sections", ()))
    delay = faults.attempt(check_nonnegative, options.get("delay", 0.0), "delay")
    clock = faults.attempt(_check_clock, options)
    run = None
    if law is not None and sections is not None and clock:
        run = faults.attempt(_what_runs, law, options, sections)
    if run is not None and delay is not None:
        faults.attempt(_check_delay, delay, run[0].sample_time)
    faults.tell()
    named, system = faults.settled(names), faults.settled(run)
    as_told = named, faults.settled(sign), faults.settled(output)
    whole, before = (None if s is None else signed(s, *as_told) for s in system)
    return _Law(
        *reference_apart(faults.settled(whole), named),
        faults.settled(delay),
        None if before is None else reference_apart(before, named)[0],
    )


def _placed(fault: SlewctlError, held: Mapping[str, Any], file: object) -> SlewctlError:
    """Return a fault with the file before it, where that holds what is wrong."""
    inside = fault.where.partition(".")[0] in held
    return fault.within(f"file: {file}") if inside else fault


def _what_runs(
    law: Law, options: Mapping[str, Any], sections: Sequence[Section]
) -> tuple[LinearSystem, LinearSystem | None]:
    """Return the law with its filters as it runs, and the continuous one that it was made of."""
    system = law.system
    if sections and system.sample_time:
        raise InputError(
            "filters are continuous, and the law is sampled",
            where="sections",
            remedy="put them into the law",
        )
    if sections:
        system = series(system, LinearSystem(*in_series(sections)))
    before = None
    if "discretise" in options:
        rule, step = options["discretise"], options["sample_time"]
        before, system = system, discretised(system, step, rule, options.get("prewarp_hz"))
    return system if law.kept else balanced(system)[0], before


def _check_clock(options: Mapping[str, Any]) -> bool:
    """Refuse each of what cannot be a clock, whatever the law."""
    rule, prewarp = options.get("discretise"), options.get("prewarp_hz")
    faults = Faults()
    if rule is None and prewarp is not None:
        faults.add([InputError("nothing is discretised", where="prewarp_hz",
                               remedy='give discretise = "tustin" too')])  # fmt: skip
    if rule is not None and "sample_time" not in options:
        faults.add([InputError("missing", where="sample_time", remedy="give the clock in s")])
    if rule is not None:
        faults.attempt(check_rule, options.get("sample_time", _NO_CLOCK), rule, prewarp)
    elif "sample_time" in options:
        faults.attempt(check_positive, options["sample_time"], "sample_time")
    faults.tell()
    return True


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
