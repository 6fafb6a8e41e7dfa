"""An arm as a rig measures it: its response with gain and dead time, held and sampled or not.

With a clock the input is held and the output sampled, and the response is that of the exact
zero-order hold with the dead time, whole samples and the rest of one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import expm

from slewctl._types import Array, ComplexArray
from slewctl.arm import Arm
from slewctl.basis import Combined, Polynomial
from slewctl.model import Model, assemble, truth
from slewctl.model.assembly import factors
from slewctl.model.ritz import ritz_modes
from slewctl.numerics.balance import balance
from slewctl.numerics.frequency_response import FrequencyResponse, axis_points
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.readings import measured
from slewctl.plant.statespace import Actuator, arm_equations

# Modes of the model: up to so many times the highest frequency measured, and as many beyond.
_REACH = 2.0
_BEYOND = 5
_MOST_MODES = 40
# Modes that tell what an arm does slowly; a pole this near to zero, over the fastest, is one at
# zero, of a rigid body, whose two are split so far by rounding; and how slow, over the others.
_FEWEST_MODES, _AT_ZERO, _SLOW = 3, 1e-7, 1e-3
# Polynomial terms on a panel beside two a mode: frequencies to 1e-7 and better.
_TERMS, _FEWEST_TERMS = 6, 8


@dataclass(frozen=True)
class Channel:
    """What a measurement is of.

    Attributes
    ----------
    actuator : {"torque", "voltage"}
    sensor : str
    sample_time : float
        In s; zero for a continuous response.
    """

    actuator: Actuator
    sensor: str
    sample_time: float = 0.0


@dataclass(frozen=True)
class Modes:
    """How an arm is discretised: its first slewing modes, of the truth or nearly so.

    Attributes
    ----------
    count : int
    functions : Polynomial or None
        In which the modes of many arms like one are computed, without asking of each whether
        its frequencies have settled; None for the truth.
    """

    count: int
    functions: Polynomial | None = None

    def model(self, arm: Arm) -> Model:
        """Return the model of an arm."""
        if self.functions is None:
            return truth(arm, self.count)
        shapes = ritz_modes(factors(arm, self.functions), "free").shapes[:, : self.count]
        return assemble(arm, Combined(self.count, self.functions, shapes))


def modes_for(arm: Arm, highest_hz: float) -> Modes:
    """Return the modes of `arm`, and of arms like it, that a measurement may show."""
    count = 8
    while True:
        found = truth(arm, count)
        below = int(np.sum(found.frequencies_hz <= _REACH * highest_hz))
        if below < count or count >= _MOST_MODES:
            break
        count = min(2 * count, _MOST_MODES)
    count = min(below + _BEYOND, _MOST_MODES)
    basis = found.basis
    if not isinstance(basis, Combined) or not isinstance(basis.parent, Polynomial):
        return Modes(count)
    panels = len(basis.parent.breakpoints) + 1
    terms = max(_TERMS + 2 * count // panels, _FEWEST_TERMS // panels + 2)
    few = Polynomial(panels * terms, basis.parent.breakpoints)
    return Modes(count, few)


@lru_cache(maxsize=32)
def equations(
    arm: Arm, actuator: Actuator, sensor: str, modes: Modes, beside: tuple[str, ...] = ()
) -> LinearSystem:
    """Return the continuous equations of an arm with so many modes, in modal coordinates.

    The first output is what the sensor reads, behind its lags; signals `beside` it are the
    arm's own.  Dead times are no part of it: gain and dead time change without them, and the
    equations are kept.
    """
    names = list(dict.fromkeys([sensor, *beside]))
    bare = arm_equations(modes.model(arm), names, actuator)
    # The arm's own signals first: the last outputs are those that are read.
    own = [*(names.index(name) for name in beside), 0]
    read = measured(LinearSystem(bare.A, bare.B, bare.C[own], bare.D[own]), arm, [sensor])
    return LinearSystem(read.A, read.B, np.roll(read.C, 1, axis=0), np.roll(read.D, 1, axis=0))


def integrations(arm: Arm, actuator: str, sensor: str) -> int:
    """Return how many poles at zero lie between an arm's actuator and a sensor's reading.

    Parameters
    ----------
    arm : Arm
    actuator : {"torque", "voltage"}
    sensor : str
    """
    driven: Actuator = "voltage" if actuator == "voltage" else "torque"
    system = equations(arm, driven, sensor, Modes(_FEWEST_MODES))
    poles = np.abs(system.poles())
    slow = _SLOW * float(np.min(poles[poles > _AT_ZERO * poles.max()]))
    size = np.abs(FrequencyResponse(system)(np.array([slow, 2 * slow])))
    if not np.all(size > 0):
        return 0
    return max(round(float(np.log2(size[0] / size[1]))), 0)


def response_of(
    system: LinearSystem, omega: Array, sample_time: float, delay: float = 0.0
) -> ComplexArray:
    """Return the response of `equations` at each ω in rad/s, shape (ω,)."""
    if not sample_time:
        return FrequencyResponse(system)(omega) * np.exp(-1j * omega * delay)
    held = HeldRig.of(system, sample_time, delay)
    now, before = held.rows(omega, np.column_stack([held.now, held.before])).T
    z = np.exp(-1j * omega * sample_time)
    straight = now + z * before
    late = system.D[0, 0] * (z if held.part else 1.0)
    return (straight + late) * z**held.whole


@dataclass(frozen=True, eq=False)
class HeldRig:
    """x(k+1) = Φx(k) + Γ₀u(k−d) + Γ₁u(k−d−1), y = Cx + D u with a dead time of (d + f)T.

    Attributes
    ----------
    transition : ndarray, shape (n, n)
    now, before : ndarray, shape (n,)
        Γ₀ and Γ₁.
    output : ndarray, shape (n,)
    whole : int
        d.
    part : float
        f, 0 <= f < 1.
    sample_time : float
    """

    transition: Array
    now: Array
    before: Array
    output: Array
    whole: int
    part: float
    sample_time: float

    @classmethod
    def of(cls, system: LinearSystem, sample_time: float, delay: float = 0.0) -> HeldRig:
        """Return the sampled equations of a continuous system, of its first output."""
        whole = int(np.floor(delay / sample_time))
        part = min(max(delay / sample_time - whole, 0.0), 1.0)
        B = system.B[:, 0]
        first, now = hold(system.A, B, (1 - part) * sample_time)
        last, before = hold(system.A, B, part * sample_time)
        return cls(first @ last, now, first @ before, system.C[0], whole, part, sample_time)

    def rows(self, omega: Array, columns: Array | None = None) -> ComplexArray:
        """Return C(zI − Φ)⁻¹ at each ω in rad/s, shape (ω, n), or that times columns (n, m)."""
        size = len(self.transition)
        right = np.eye(size) if columns is None else columns
        turned = LinearSystem(
            self.transition.T, self.output[:, None], right.T, np.zeros((right.shape[1], 1)),
            self.sample_time,
        )  # fmt: skip
        found = FrequencyResponse(turned).at(axis_points(omega, self.sample_time))
        return np.asarray(found.reshape(len(omega), right.shape[1]))


def hold(A: Array, B: Array, h: float) -> tuple[Array, Array]:
    """Return e^(Ah) and ∫₀ʰ e^(As)B ds."""
    size = len(A)
    scale = np.ones(size + 1)
    scale[:size] = balance(A)
    both = np.zeros((size + 1, size + 1))
    both[:size, :size], both[:size, size] = A, B
    both = expm(both / scale[:, None] * scale * h) * scale[:, None] / scale
    return both[:size, :size], both[:size, size]
