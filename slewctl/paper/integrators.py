"""One-step integrators and what they do to an undamped mode: the first finding.

An undamped mode ω stepped with h is multiplied by the amplification factor R(±iωh) of the
method.  The spectral radius of the one-step map of a whole model is the largest |R| over
its modes.  It is computed from the modal frequencies: the rigid-body rotation makes 1 a
double defective eigenvalue of the step matrix, which an eigenvalue routine returns with
an error of 1e-8.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.arm.catalogue import paper_beam
from slewctl.basis import Basis, ClampedFree, Slewing
from slewctl.model import assemble
from slewctl.paper import published


@dataclass(frozen=True)
class Integrator:
    """A method for M ẍ + K x = b τ with the torque constant over a step.

    Attributes
    ----------
    name : str
    radius : callable
        Largest |eigenvalue| of one step of an undamped mode, as a function of ωh (array).
    limit : float or None
        Largest ωh at which an undamped mode does not grow; None when there is no limit.
    """

    name: str
    radius: Callable[[Array], Array]
    limit: float | None


def _exact(wh: Array) -> Array:
    return np.ones_like(wh)  # |exp(iωh)| is one, whatever rounding would make of it


def _taylor(order: int) -> Callable[[Array], Array]:
    """R(z) = Σ z^k/k!, the explicit Runge–Kutta methods of order 1 to 4 among others."""

    def radius(wh: Array) -> Array:
        return np.abs(sum((1j * wh) ** k / math.factorial(k) for k in range(order + 1)))

    return radius


def _implicit_euler(wh: Array) -> Array:
    return 1 / np.hypot(1.0, wh)


def _trapezoidal(wh: Array) -> Array:
    return np.abs(1 + 0.5j * wh) / np.abs(1 - 0.5j * wh)


def _newmark(beta: float) -> Callable[[Array], Array]:
    """γ = ½: the eigenvalues satisfy λ² − 2aλ + 1 = 0, a = 1 − ½(ωh)²/(1 + β(ωh)²)."""

    def radius(wh: Array) -> Array:
        a = np.abs(1 - wh**2 / 2 / (1 + beta * wh**2))
        return np.asarray(np.where(a > 1, a + np.sqrt(np.maximum(a**2 - 1, 0.0)), 1.0))

    return radius


INTEGRATORS = (
    Integrator("exact zero-order hold", _exact, None),
    Integrator("explicit Euler", _taylor(1), 0.0),
    Integrator("Taylor / Runge-Kutta, order 2", _taylor(2), 0.0),
    Integrator("Taylor / Runge-Kutta, order 3", _taylor(3), math.sqrt(3.0)),
    Integrator("Taylor / Runge-Kutta, order 4", _taylor(4), math.sqrt(8.0)),
    Integrator("central difference (Störmer-Verlet)", _newmark(0.0), 2.0),
    Integrator("Newmark, linear acceleration", _newmark(1 / 6), math.sqrt(12.0)),
    Integrator("trapezoidal (Tustin; Newmark, average acceleration)", _trapezoidal, None),
    Integrator("implicit Euler", _implicit_euler, None),
)


@dataclass(frozen=True, eq=False)
class SampledModel:
    """The frequencies of a five-function model of the paper's beam against the step.

    Attributes
    ----------
    basis : str
    frequencies_hz, omega_h : ndarray, shape (5,)
    above_nyquist : tuple of int
        Flexible modes (counted from 1) above the Nyquist frequency.
    apparent_hz : ndarray, shape (5,)
        Frequency at which each mode shows in the samples: its own, or its alias.
    """

    basis: str
    frequencies_hz: Array
    omega_h: Array
    above_nyquist: tuple[int, ...]
    apparent_hz: Array


@dataclass(frozen=True, eq=False)
class ModelRadius:
    """One integrator on one model.

    Attributes
    ----------
    spectral_radius : float
        Largest |R| over all modes, the rigid-body rotation (|R| = 1) included.
    mode_radii : ndarray, shape (5,)
        |R| of each flexible mode: below one, the method damps it.
    stable : bool
        Whether the largest ωh is within the method's limit.
    largest_step_s : float or None
        Longest step that keeps the model stable; None when every step does.
    """

    spectral_radius: float
    mode_radii: Array
    stable: bool
    largest_step_s: float | None


@dataclass(frozen=True, eq=False)
class IntegratorRow:
    """One integrator on both models; `limit` is the largest stable ωh, None if unlimited."""

    integrator: str
    limit: float | None
    clamped_free: ModelRadius
    slewing: ModelRadius


@dataclass(frozen=True, eq=False)
class IntegratorFinding:
    """Whether the simulation is stable depends on the integrator.

    Attributes
    ----------
    step_s, nyquist_hz : float
    clamped_free, slewing : SampledModel
    rows : tuple of IntegratorRow
    """

    step_s: float
    nyquist_hz: float
    clamped_free: SampledModel
    slewing: SampledModel
    rows: tuple[IntegratorRow, ...]


def integrator_finding() -> IntegratorFinding:
    """Return the spectral radii of both five-function models at the paper's step."""
    step = published.SAMPLE_TIME
    models = [_sampled(kind(published.FUNCTIONS), step) for kind in (ClampedFree, Slewing)]
    rows = tuple(
        IntegratorRow(method.name, method.limit, *(_radius(method, m, step) for m in models))
        for method in INTEGRATORS
    )
    return IntegratorFinding(step, 1 / (2 * step), models[0], models[1], rows)


def _sampled(basis: Basis, step: float) -> SampledModel:
    model = assemble(paper_beam(), basis)
    hertz = model.frequencies_hz
    above = np.flatnonzero(model.omega * step > np.pi) + 1
    return SampledModel(
        basis.name,
        hertz,
        model.omega * step,
        tuple(int(i) for i in above),
        np.abs(hertz - np.round(hertz * step) / step),
    )


def _radius(method: Integrator, model: SampledModel, step: float) -> ModelRadius:
    radii = method.radius(model.omega_h)
    highest = float(model.omega_h[-1])
    return ModelRadius(
        max(1.0, float(radii.max())),
        radii,
        method.limit is None or highest <= method.limit,
        None if method.limit is None else method.limit / highest * step,
    )
