"""The delay that a sampled loop around a continuous plant stands, by any fraction of a sample.

A delay τ = dT + m of the continuous signal changes the sampled plant: its whole samples d
multiply L by z^(−d), the rest m, less than a sample, changes how the held input falls into
each period.  For each m the delay margin of the sampled loop L_m, in samples and not
rounded, comes from its crossings of |L_m| = 1; the loop is stable for all whole d below it.
The smallest delay at which some d reaches that margin is the margin of the hybrid loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from slewctl._types import Array
from slewctl.errors import AccuracyError
from slewctl.loop.single.crossings import crossings, log_gain, sampled
from slewctl.loop.single.return_ratio import BrokenLoop
from slewctl.numerics.balance import balance
from slewctl.numerics.interconnect import series
from slewctl.numerics.linear_system import LinearSystem

# Fractions of a sample at which the loop is examined, at least and at most.
_LEAST, _MOST = 16, 64
# Loops with more states than this are not asked for their poles again.
_LARGE = 400
_STEP = 1e-6
LoopWithDelay = Callable[[float], LinearSystem]


@dataclass(frozen=True)
class HybridDelay:
    """The delay margin of a sampled loop around a continuous plant.

    Attributes
    ----------
    seconds : float
        Infinite where |L| stays below one whatever the delay.
    omega : float or None
        Where the pole reaches the unit circle, in rad/s, at or below half the sampling
        frequency; in the continuous plant it may belong to a mode above that.
    tried : int
        Number of fractions of a sample at which the loop was examined.
    confirmed : bool
        Whether closed-loop poles at 1 ∓ 1e-6 of the margin are stable and unstable.
    """

    seconds: float
    omega: float | None
    tried: int
    confirmed: bool


def smallest_delay(
    loop_with_delay: LoopWithDelay, sample_time: float, fastest: float = 0.0
) -> HybridDelay:
    """Return the smallest delay of the continuous signal that makes a sampled loop unstable.

    What is guaranteed: at every fraction of a sample that was examined, j/`tried`, the loop
    is stable for all delays below the margin, by an exact count of crossings; the margin
    itself is a root, found to rounding.  A pole that leaves the unit circle and returns
    between two such fractions is not seen.

    Parameters
    ----------
    loop_with_delay : callable
        From an additional delay in s, less than `sample_time` for most calls, to the return
        ratio L as a sampled system; stable when closed without additional delay.
    sample_time : float
        T in s.
    fastest : float
        Frequency in rad/s, of the continuous plant, above which no mode matters: the
        fractions are chosen to be a twelfth of its period at most.

    Raises
    ------
    AccuracyError
        If the root cannot be enclosed.
    """
    wanted = int(np.ceil(fastest * sample_time * 12 / (2 * np.pi)))
    parts = min(max(wanted, _LEAST), _MOST)
    fractions = np.arange(parts) / parts
    margins = [_samples_to_limit(loop_with_delay(f * sample_time))[0] for f in fractions]
    # The first whole number of samples that is too many, at each fraction.
    first = np.array([np.ceil(d) for d in margins]) + fractions
    if np.all(np.isinf(first)):
        return HybridDelay(np.inf, None, parts, True)
    k = int(np.argmin(first))
    end = float(first[k])
    start = end - 1 / parts
    if end == 0:
        raise AccuracyError(
            "the sampled loop is not stable without additional delay", where="hybrid_delay_margin"
        )
    whole = int(np.floor(start + 1e-12))

    def spare(samples: float) -> float:
        return _samples_to_limit(loop_with_delay((samples - whole) * sample_time))[0] - whole

    def growth(samples: float) -> float:
        loop = BrokenLoop(loop_with_delay(samples * sample_time))
        return float(loop.growth(loop.poles).max())

    # Within the first sample there are no whole samples to count: the poles themselves decide.
    root = _enclosed(spare if whole else growth, start, end)
    at_limit = loop_with_delay((root - whole) * sample_time)
    omega = _samples_to_limit(at_limit)[1] if whole else _critical(at_limit)
    sure = confirmed(loop_with_delay, root * sample_time)
    return HybridDelay(root * sample_time, omega, parts, sure)


def _enclosed(function: Callable[[float], float], start: float, end: float) -> float:
    from scipy.optimize import brentq  # slow to load: not before it is wanted

    try:
        return float(brentq(function, start, end, xtol=1e-13 * end, rtol=1e-14))
    except ValueError as error:
        raise AccuracyError(
            "the delay margin could not be enclosed", where="hybrid_delay_margin"
        ) from error


def _critical(system: LinearSystem) -> float:
    """Return the frequency in rad/s of the closed-loop pole nearest to the unit circle."""
    loop = BrokenLoop(system)
    pole = loop.poles[np.argmax(loop.growth(loop.poles))]
    return float(abs(np.angle(1 + pole)) / loop.step)


def _samples_to_limit(system: LinearSystem) -> tuple[float, float | None]:
    """Return the delay margin in samples, not rounded, and its ω; (0, None) if unstable."""
    loop = BrokenLoop(system)
    if loop.unstable(1.0)[1]:
        return 0.0, None
    gain = crossings(loop, sampled(loop), log_gain)
    late = np.mod(np.angle(-loop.response(gain.omega)), 2 * np.pi) / (gain.omega * loop.step)
    found, at = late, gain.omega
    if abs(loop.last) >= 1:
        found = np.append(found, np.arccos(-1 / loop.last) / np.pi)
        at = np.append(at, loop.response.nyquist)
    if not len(found):
        return np.inf, None
    k = int(np.argmin(found))
    return float(found[k]), float(at[k])


def confirmed(loop_with_delay: LoopWithDelay, seconds: float) -> bool:
    """Whether poles are stable just inside the margin and unstable just outside."""
    inside, outside = (loop_with_delay(seconds * (1 + sense * _STEP)) for sense in (-1, 1))
    if max(inside.nstates, outside.nstates) > _LARGE:
        return False
    return BrokenLoop(inside).unstable(1.0)[0] == 0 and BrokenLoop(outside).unstable(1.0)[1] > 0


def delayed_loop(
    plant: LinearSystem, controller: LinearSystem, delay: float = 0.0
) -> LoopWithDelay:
    """Return the return ratio of a continuous plant under a sampled controller, by its delay.

    Parameters
    ----------
    plant : LinearSystem
        Continuous, one input.
    controller : LinearSystem
        Sampled, from the plant's outputs to its input, under negative feedback.
    delay : float
        In s, that the loop has already: from the sample to the input computed from it.

    Returns
    -------
    callable
        From additional delay in s to L = K·P as a sampled system, broken at the hold.
    """
    seen = _by_delay(plant, controller.sample_time)
    return lambda more: series(seen(delay + more), controller)


def held_plant(plant: LinearSystem, step: float, delay: float) -> LinearSystem:
    """Return a continuous plant as a controller with a sample time and a delay in s sees it."""
    return _by_delay(plant, step)(delay)


def _by_delay(plant: LinearSystem, step: float) -> LoopWithDelay:
    A, B, C, D = (np.asarray(getattr(plant, name), dtype=float) for name in "ABCD")
    scale = balance(A)
    A, B, C = A / scale[:, None] * scale, B / scale[:, None], C * scale
    return lambda delay: sampled_with_delay(A, B, C, D, step, delay)


def sampled_with_delay(
    A: Array, B: Array, C: Array, D: Array, step: float, delay: float
) -> LinearSystem:
    """Return a continuous plant with a hold and a delay of its input, as sampled at kT.

    x_{k+1} = e^(AT)x_k + e^(A(T−m))Γ(m)u_{k−d−1} + Γ(T−m)u_{k−d} with the delay dT + m and
    Γ(h) = ∫₀ʰ e^(At) dt B (Åström and Wittenmark, Computer-Controlled Systems, section 2.3).

    Parameters
    ----------
    A, B, C, D : ndarray, shapes (n, n), (n, 1), (p, n), (p, 1)
    step, delay : float
        T and the delay in s.
    """
    n = len(A)
    whole = int(np.floor(delay / step + 1e-12))
    part = max(delay - whole * step, 0.0)
    waiting = whole + (part > 0)
    earlier, later = held(A, B, part), held(A, B, step - part)
    big = np.zeros((n + waiting, n + waiting))
    big[:n, :n] = later[0] @ earlier[0]
    inputs = np.zeros((n + waiting, 1))
    direct = np.zeros((len(C), n + waiting))
    direct[:, :n] = C
    if not waiting:
        return LinearSystem(big, later[1], direct, D, step)
    # Inputs on their way: the latest, u_{k−1}, first.
    big[n + 1 :, n:-1] = np.eye(waiting - 1)
    inputs[n] = 1
    oldest = later[0] @ earlier[1]
    if part:
        big[:n, n + waiting - 1] += oldest[:, 0]
    if whole:
        big[:n, n + whole - 1] += later[1][:, 0]
    else:
        inputs[:n] += later[1]
    direct[:, n + waiting - 1] = D[:, 0]
    return LinearSystem(big, inputs, direct, np.zeros_like(D), step)


def held(A: Array, B: Array, h: float) -> tuple[Array, Array]:
    """Return e^(Ah) and ∫₀ʰ e^(At) dt B."""
    n, m = B.shape
    whole = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * h)
    return whole[:n, :n], whole[:n, n:]


def fastest_that_matters(plant: LinearSystem, loop: LinearSystem) -> float:
    """Return the highest frequency in rad/s, of crossings and of modes that L shows above 0.3.

    A mode above half the sampling frequency appears in L below it, with its own size.
    """
    broken = BrokenLoop(loop)
    gain = crossings(broken, sampled(broken), log_gain).omega
    poles = np.linalg.eigvals(np.asarray(plant.A))
    rates = np.unique(np.abs(poles[poles.imag > 0].imag))
    seen = np.abs(broken.response(rates)) > 0.3 if len(rates) else np.zeros(0, dtype=bool)
    return float(max([0.0, *gain, *rates[seen]]))
