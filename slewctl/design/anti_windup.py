"""How a controller is told that its command was limited.

An observer is driven by the input that acted: what it lacks, applied − commanded, enters where
its own command does (Åström and Rundqwist, American Control Conference 1989).  Of any other
law the integrators are led back by the same difference in the time constant of their own
action (back-calculation), T_t = gain without the integral / integral gain, which is T_i of a
PID.
"""

from __future__ import annotations

import numpy as np

from slewctl._types import Array
from slewctl.design.result import Controller

# A pole this near to that of an integrator, relative to the law's fastest, is one.
_INTEGRATES = 1e-9
# Samples, or seconds of the fastest pole, in which an integrator without other gain is led back.
_ALONE = 10.0


def anti_windup(controller: Controller) -> tuple[Array, str]:
    """Return the column by which applied − commanded enters a law's states, and its name.

    Parameters
    ----------
    controller : Controller

    Returns
    -------
    tuple of ndarray, shape (states,), and str
    """
    entry, words = _entry(controller)
    A, _, C, _ = controller.linear.matrices
    T = controller.sample_time
    if left := winding(A, C, entry, T):
        words = f"{left} winds up, and nothing leads it back"
    elif len(A) and not entry.any() and np.isfinite(lasting := fading(A, T)):
        words = f"nothing to lead back, all fades with a time constant of {lasting:.3g} s"
    return entry, words


def fading(A: Array, sample_time: float) -> float:
    """Return the longest time constant in s; zero where all is gone after a sample.

    Parameters
    ----------
    A : ndarray, shape (n, n)
        Of what decays, or of poles that the command does not show: infinite then.
    sample_time : float
    """
    poles = np.linalg.eigvals(A)
    with np.errstate(divide="ignore"):
        rate = -np.log(np.abs(poles)) / sample_time if sample_time else -poles.real
    slowest = float(rate.min())
    return 1 / slowest if slowest > 0 else np.inf


def winding(A: Array, C: Array, entry: Array, sample_time: float) -> str:
    """Return which poles of a law go on while its command is cut off; empty if all of it settles.

    Parameters
    ----------
    A, C : ndarray, shapes (n, n), (1, n)
    entry : ndarray, shape (n,)
        From `anti_windup`.
    sample_time : float
    """
    if not len(A):
        return ""
    poles, vectors = np.linalg.eig(A - np.outer(entry, C[0]))
    shown = np.abs(C[0] @ vectors) > _INTEGRATES * float(np.linalg.norm(C))
    size = 1.0 if sample_time else float(np.abs(poles).max())
    edge, reach = (1.0, np.abs(poles) - 1) if sample_time else (0.0, poles.real)
    found: list[str] = []
    for pole in poles[(reach >= -_INTEGRATES * size) & shown & (poles.imag >= 0)]:
        # Of a double pole rounding makes two, as far from it as the root of what is left out.
        if abs(pole - edge) <= np.sqrt(_INTEGRATES) * size:
            found.append("an integrator")
        else:
            s = np.log(complex(pole)) / sample_time if sample_time else pole
            found.append(f"a pole at {abs(s) / (2 * np.pi):.4g} Hz")
    return " and ".join(dict.fromkeys(found))


def _entry(controller: Controller) -> tuple[Array, str]:
    A, B, C, D = controller.linear.matrices
    T = controller.sample_time
    entry = np.zeros(len(A))
    words = "nothing to wind up"
    if controller.entry is not None:
        entry = np.asarray(controller.entry, dtype=float).ravel()
        words = "the observer sees the limited input"
        A = A - np.outer(entry, C[0])
    if not len(A):
        return entry, words
    poles, left = np.linalg.eig(A.T)
    edge = 1.0 if T else 0.0
    fastest = max(float(np.abs(poles).max()), 1.0 if T else 0.0)
    for k in np.flatnonzero(np.abs(poles - edge) <= _INTEGRATES * fastest):
        w = left[:, k].real
        right = _partner(A, w, edge)
        if right is None:
            continue
        seen = float(C[0] @ right)
        if seen == 0:
            continue
        integral = np.linalg.norm(seen * (w @ B))
        steady = np.linalg.norm(_without(A, B, C, D, right, w, edge))
        # Of a sampled law the integral is counted per sample, and so is the time.
        if steady > 0 and integral > 0:
            time = float(steady / integral)
        elif T or fastest:
            time = _ALONE / (1 if T else fastest)
        else:
            continue  # an integrator and nothing else, which no time is told by
        share = -np.expm1(-1 / time) if T else 1 / time
        entry = entry + share / seen * right
        extra = "the integral is led back"
        words = extra if controller.entry is None else f"{words}, {extra}"
    return entry, words


def _partner(A: Array, w: Array, edge: float) -> Array | None:
    """Return the right eigenvector v of the same pole, with wᵀv = 1; None of a double one."""
    poles, vectors = np.linalg.eig(A)
    v = vectors[:, int(np.argmin(np.abs(poles - edge)))].real
    across = float(w @ v)
    if abs(across) <= _INTEGRATES * float(np.linalg.norm(w) * np.linalg.norm(v)):
        return None
    return np.asarray(v / across)


def _without(A: Array, B: Array, C: Array, D: Array, v: Array, w: Array, edge: float) -> Array:
    """Return the law's gain at rest without its integrator, shape (1, sensors)."""
    apart = np.outer(v, w)
    rest = edge * np.eye(len(A)) - A + apart
    keep = np.eye(len(A)) - apart
    return np.asarray(C @ keep @ np.linalg.solve(rest, keep @ B) + D)
