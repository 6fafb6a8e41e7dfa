"""A continuous law turned into the difference equation that a computer runs."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigvals

from slewctl._types import Array, ComplexArray
from slewctl.arm.magnitudes import check_duration
from slewctl.design.coordinates import balanced
from slewctl.design.reference import Reference, with_reference
from slewctl.design.zeros_poles import cascade
from slewctl.errors import Faults, InputError, check_choice, check_positive
from slewctl.numerics.linear_system import LinearSystem

# A Markov parameter that is smaller, relative to what it is made of, is none.
_NOTHING = 1e-12

RULES = ("tustin", "zoh", "matched")


def discretised(
    system: LinearSystem,
    sample_time: float,
    rule: str = "tustin",
    prewarp_hz: float | None = None,
) -> LinearSystem:
    """Return a continuous system as a sampled one (Franklin, Powell and Workman, chapter 6).

    Parameters
    ----------
    system : LinearSystem
    sample_time : float
        T in s.
    rule : {"tustin", "zoh", "matched"}
        The trapezoidal rule; the exact response to inputs that are held; or every pole and
        zero s as z = e^(sT), zeros at infinity at z = −1, with the gain of the lowest
        frequencies, of one input.
    prewarp_hz : float, optional
        Where the trapezoidal rule keeps gain and phase exactly, below half the sampling
        frequency.

    Raises
    ------
    InputError
        For another rule, several inputs where one is wanted, an impossible frequency, or a
        system that the rule cannot take.
    """
    check_rule(sample_time, rule, prewarp_hz)
    T = float(sample_time)
    if system.sample_time:
        raise InputError(
            "the law is sampled already",
            where="discretise",
            remedy="leave it out, or give the continuous law",
        )
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # told below
        if rule == "matched":
            sampled = _matched(system, T)
        else:
            held = rule == "zoh"
            sampled = _held(system, T) if held else _trapezoidal(system, T, prewarp_hz)
    if not sampled.finite:
        fastest = np.abs(system.poles()).max(initial=0.0)
        raise InputError(
            f"at {T:g} s the law is no longer finite: its fastest pole is at {fastest:.3g} rad/s",
            where="sample_time",
            remedy="give a law whose poles the clock can follow",
        )
    return sampled


def discretised_with_path(
    law: LinearSystem,
    reference: Reference,
    sample_time: float,
    rule: str = "tustin",
    prewarp_hz: float | None = None,
) -> tuple[LinearSystem, Reference]:
    """Return a law and the reference's path through it, both by the same rule.

    Parameters
    ----------
    law : LinearSystem
    reference : Reference
    sample_time, rule, prewarp_hz
        As for `discretised`.
    """
    whole = discretised(with_reference(law, reference), sample_time, rule, prewarp_hz)
    n = whole.ninputs - 1
    system = LinearSystem(
        whole.A, whole.B[:, :n], whole.C, whole.D[:, :n], whole.dt,
        inputs=law.input_labels, outputs=law.output_labels,
        states=law.state_labels, name=law.name,
    )  # fmt: skip
    return system, Reference(whole.B[:, n:], whole.D[:, n:])


def discretised_entry(
    law: LinearSystem,
    entry: Array | None,
    sample_time: float,
    rule: str = "tustin",
    prewarp_hz: float | None = None,
) -> Array | None:
    """Return how a limited input enters the states of what runs, by the same rule.

    Parameters
    ----------
    law : LinearSystem
    entry : ndarray or None, shape (n, 1)
        How it enters those of the law; see `slewctl.design.Controller`.
    sample_time, rule, prewarp_hz
        As for `discretised`.
    """
    if entry is None or rule == "matched":
        return None
    A, B, C, D = law.matrices
    whole = LinearSystem(A, np.hstack([B, entry]), C, np.hstack([D, np.zeros((1, 1))]))
    return np.asarray(discretised(whole, sample_time, rule, prewarp_hz).B[:, -1:])


def check_rule(sample_time: float, rule: str, prewarp_hz: float | None) -> None:
    """Refuse each of what cannot make a continuous law a sampled one, whatever the law."""
    faults = Faults()
    T = faults.attempt(check_duration, sample_time, "sample_time")
    faults.attempt(check_choice, rule, RULES, "discretise")
    if prewarp_hz is not None:
        faults.attempt(_check_prewarp, prewarp_hz, rule, T)
    faults.tell()


def _check_prewarp(prewarp_hz: float, rule: str, T: float | None) -> None:
    check_positive(prewarp_hz, "prewarp_hz")
    if rule in RULES and rule != "tustin":
        raise InputError(
            f"{rule} has nothing to prewarp", where="prewarp_hz", remedy='use it with "tustin"'
        )
    if T is not None and prewarp_hz * T >= 0.5:
        raise InputError(
            f"{prewarp_hz:g} Hz is not below half the sampling frequency, {0.5 / T:g} Hz",
            where="prewarp_hz",
            remedy="give the crossover's frequency, or sample faster",
        )


def _like(system: LinearSystem, matrices: Sequence[Array], T: float) -> LinearSystem:
    A, B, C, D = matrices
    return LinearSystem(
        A, B, C, D, T, inputs=system.input_labels, outputs=system.output_labels, name=system.name
    )


def _trapezoidal(system: LinearSystem, T: float, prewarp_hz: float | None) -> LinearSystem:
    step = T
    if prewarp_hz is not None:
        omega = 2 * math.pi * prewarp_hz
        step = 2 * math.tan(omega * T / 2) / omega
    return _by_scipy(system, T, step, "bilinear")


def _held(system: LinearSystem, T: float) -> LinearSystem:
    return _by_scipy(system, T, T, "zoh")


def _by_scipy(system: LinearSystem, T: float, step: float, method: str) -> LinearSystem:
    from scipy.signal import cont2discrete  # slow to load: not before it is wanted

    if not system.nstates:
        return _like(system, system.matrices, T)
    try:
        *found, _ = cont2discrete(system.matrices, step, method)  # type: ignore[call-overload]
    except np.linalg.LinAlgError:
        raise InputError(
            f"the law has a pole at {2 / step:g} rad/s, which the rule sends to infinity",
            where="discretise",
            remedy="sample faster",
        ) from None
    return _like(system, found, T)


def _matched(system: LinearSystem, T: float) -> LinearSystem:
    if system.ninputs != 1 or system.noutputs != 1:
        raise InputError(
            f"matched is for one input, the law has {system.ninputs}",
            where="discretise",
            remedy='use "tustin" or "zoh"',
        )
    zeros, gain = _zeros(system)
    poles = system.poles()
    return matched_zpk(zeros, poles, gain, T).named(
        system.input_labels, system.output_labels, name=system.name
    )


def _zeros(system: LinearSystem) -> tuple[ComplexArray, float]:
    """Return the finite zeros of a system of one input, and its gain k s^(-r) far out.

    How many there are is read off the first Markov parameter that is not zero, since an
    infinite zero of high order is computed as a finite one.
    """
    A, B, C, D = balanced(system)[0].matrices
    size = np.linalg.norm(B) * np.linalg.norm(C)
    if D[0, 0]:
        relative, gain = 0, D[0, 0]
    else:
        column, relative, gain = B, 1, (C @ B)[0, 0]
        bound = size
        while abs(gain) <= _NOTHING * bound:
            if relative == len(A):
                raise InputError("the law is zero", where="discretise", remedy="give another")
            column, relative, bound = A @ column, relative + 1, bound * np.linalg.norm(A)
            gain = (C @ column)[0, 0]
    whole = np.block([[A, B], [C, D]])
    alone = np.zeros_like(whole)
    alone[: len(A), : len(A)] = np.eye(len(A))
    found = eigvals(whole, alone)
    found = np.where(np.isfinite(found), found, np.inf)
    finite = found[np.argsort(np.abs(found))][: len(A) - relative]
    return finite.astype(complex), float(gain)


def matched_zpk(zeros: ComplexArray, poles: ComplexArray, gain: float, T: float) -> LinearSystem:
    """Return the sampled system of mapped zeros and poles, with the continuous one's low gain."""
    z_zeros = np.concatenate([np.exp(zeros * T), -np.ones(len(poles) - len(zeros))])
    # Near rest (z − e^(sT)) is T·(p − s) for a root s at zero, and a constant for others.
    rest, below = ([np.expm1(s * T) / s if s else T for s in roots] for roots in (zeros, poles))
    factor = np.prod(below) / (np.prod(rest) * 2.0 ** (len(poles) - len(zeros)))
    return cascade(z_zeros, np.exp(poles * T), float(np.real(gain * factor)), T)
