"""Random arms, and controllers that the package designs for them, good and bad ones."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import control
import numpy as np
from own_loop import Law
from scipy.signal import cont2discrete

import slewctl as sc
from slewctl.basis import NAMES
from slewctl.compare.design_basis import design_model
from slewctl.design import METHODS, given

SENSORS = (
    ("theta",),
    ("theta", "theta_dot"),
    ("tip",),
    ("theta", "tip"),
    ("theta", "theta_dot", "tip"),
    ("theta", "tip_deflection"),
    ("theta", "moment"),
    ("theta", "deflection"),
    ("theta", "root_moment"),
)
SHARES = {
    "lqg": 0.3, "sampled": 0.26, "integral": 0.06, "pole-placement": 0.08, "pd-notch": 0.06,
    "lead": 0.05, "positive-position": 0.05, "companion": 0.08, "sampled companion": 0.06,
}  # fmt: skip
SOURCES = (*(name for name in NAMES if name != "polynomial"), "balanced-truncation")


@dataclass(frozen=True, eq=False)
class Design:
    """A controller for an arm, and what it is judged by.

    Attributes
    ----------
    kind, source : str
        Method and what it was made on, for counts and messages.
    modes : int
        That the truth keeps.
    """

    arm: sc.Arm
    objective: sc.Objective
    controller: sc.Controller
    kind: str
    source: str
    n: int
    modes: int

    @property
    def law(self) -> Law:
        """The controller's matrices and clock."""
        k = self.controller
        A, B, C, D = (np.asarray(getattr(k.system, name)) for name in "ABCD")
        actuator = self.objective.actuator
        return Law(A, B, C, D, k.sensors, actuator, k.sample_time, k.delay)

    def loop(self, modes: int) -> sc.Loop:
        """Return the package's loop on a truth of so many modes."""
        return sc.close(sc.truth(self.arm, modes), self.objective, self.controller)

    def stable(self, modes: int) -> bool:
        """Return the package's verdict on a truth of so many modes."""
        return self.loop(modes).stable

    def scaled(self, gain: float) -> Design:
        """Return the same with the controller's output times `gain`."""
        k = self.controller
        return replace(self, controller=_given(replace(self.law, C=gain * self.law.C,
                                                       D=gain * self.law.D), k.delay))  # fmt: skip

    def __str__(self) -> str:
        clock = f" every {self.controller.sample_time:g} s" if self.controller.sample_time else ""
        return (
            f"{self.kind}{clock} on {self.n} of {self.source}, judged on {self.modes} modes: "
            f"{self.arm!r}, {self.objective!r}"
        )


def random_arm(rng: np.random.Generator) -> sc.Arm:
    """Return an arm with any taper or step, hub, payload, damping and, often, a motor."""
    length, mass, stiffness = (float(v) for v in 10 ** rng.uniform([-1, -2, -2], [1, 2, 4]))
    inertia = mass * length**3 / 3
    hub = 0.0 if rng.random() < 0.25 else inertia * 10 ** rng.uniform(-3, 1.5)
    rate = math.sqrt(stiffness / (mass * length**4))  # of the order of the first frequency
    law: sc.Rayleigh | sc.KelvinVoigt | None = None
    if rng.random() < 0.2:
        law = sc.KelvinVoigt(float(10 ** rng.uniform(-5, -2) / rate))
        if rng.random() < 0.5:
            law = sc.Rayleigh(float(10 ** rng.uniform(-4, -2) * rate), law.retardation_time)
    ratio: float | tuple[float, ...] = float(10 ** rng.uniform(-4, np.log10(0.03)))
    if rng.random() < 0.2:
        ratio = tuple(float(v) for v in 10 ** rng.uniform(-4, np.log10(0.03), 3))
    friction = float(inertia * rate * 10 ** rng.uniform(-4, 0)) if rng.random() < 0.3 else 0.0
    return sc.Arm(
        sc.Beam(length, _profile(rng, mass, length), _profile(rng, stiffness, length)),
        sc.Hub(float(hub), float(length * rng.choice([0.0, 0.05, 0.3])), friction),
        sc.Payload(
            float(mass * length * rng.choice([0.0, 0.0, 0.2, 1.0, 5.0])),
            float(inertia * rng.choice([0.0, 0.0, 0.01, 0.1])),
        ),
        damping_ratio=ratio,
        damping=law,
        motor=_motor(rng, inertia + hub, rate) if rng.random() < 0.35 else None,
    )


def _profile(
    rng: np.random.Generator, size: float, length: float
) -> float | tuple[float, ...] | sc.Stations:
    kind = rng.integers(4)
    if kind == 0:
        return size
    if kind == 1:
        return (size, *(0.0,) * int(rng.integers(0, 3)), float(size * rng.uniform(-0.9, 0.5)))
    at = float(length * rng.choice([0.2, 0.45, 0.7]))
    drop = float(rng.uniform(0.15, 1.5))
    if kind == 2:
        return sc.Stations((0.0, at, at, length), (size, size, drop * size, drop * size))
    return sc.Stations((0.0, at, length), (size, drop * size, 0.5 * drop * size))


def _motor(rng: np.random.Generator, inertia: float, rate: float) -> sc.Motor:
    """Return a motor whose rotor, geared, and back-EMF are of the arm's size."""
    gear = float(10 ** rng.uniform(0, 2))
    efficiency = float(rng.uniform(0.6, 1.0))
    constant = math.sqrt(float(inertia * rate * 10 ** rng.uniform(-2, 1))) / gear
    return sc.Motor(
        resistance=float(10 ** rng.uniform(-0.5, 1)),
        torque_constant=constant,
        back_emf_constant=constant,
        gear_ratio=gear,
        gear_efficiency=efficiency,
        rotor_inertia=float(inertia * 10 ** rng.uniform(-3, 0)) / gear**2,
    )


def random_objective(rng: np.random.Generator, arm: sc.Arm, kind: str) -> sc.Objective:
    """Return limits and noises in units of the arm, over several decades of each."""
    first = sc.truth(arm, 4)
    speed = float(first.omega[0] * 10 ** rng.uniform(-2, 0.3))
    torque = float(first.mass[0, 0] * speed**2)
    reach = arm.hub.radius + arm.beam.length
    unit = {"theta": 1.0, "theta_dot": speed, "tip": reach, "tip_deflection": reach,
            "moment": torque, "deflection": reach, "root_moment": torque}  # fmt: skip
    named = {name: name for name in unit}
    for name, at in (("moment", 0.31), ("deflection", 0.6)):
        named[name] = f"{name}@{round(at * arm.beam.length * 1e6)}um"
    sensors = SENSORS[int(rng.integers(len(SENSORS)))]
    if kind == "positive-position":
        sensors = SENSORS[int(rng.choice([3, 5, 6, 7]))]
    if "companion" in kind:
        sensors = ("theta",)
    if arm.hub_inertia == 0:
        sensors = tuple(name for name in sensors if name != "root_moment")
    limit = str(rng.choice(["theta", "tip"]))
    spread = 10 ** rng.uniform(-3, 1)
    limits = {limit: unit[limit], "torque": float(torque * 10 ** rng.uniform(-1, 1))}
    if arm.motor is not None and rng.random() < 0.7:
        limits["voltage"] = limits.pop("torque") / arm.motor.torque_per_volt
    noise = {named[name]: float(spread * unit[name] * 10 ** rng.uniform(-1, 1)) for name in sensors}
    return sc.Objective(limits, {"torque": torque, **noise})


def _given(law: Law, delay: float) -> sc.Controller:
    """Return a controller with these matrices."""
    system = control.StateSpace(
        law.A, law.B, law.C, law.D, law.sample_time, inputs=list(law.sensors),
        outputs=[law.actuator],
    )  # fmt: skip
    return given(system, feedback="positive", delay=delay)


def companion(rng: np.random.Generator, arm: sc.Arm, objective: sc.Objective, hertz: float,
              sampled: bool) -> sc.Controller:  # fmt: skip
    """Return PD or PID control of the hub angle with two lags, fast or slow, in companion form."""
    band = float(2 * math.pi * hertz * 10 ** rng.uniform(-1.5, 0.2))
    inertia = float(sc.truth(arm, 4).mass[0, 0])
    lag = 1 / (band * 10 ** rng.uniform(0.5, 4))
    gains = inertia * np.array([1.4 * band, band**2, 0.3 * band**3])
    if objective.actuator == "voltage" and arm.motor is not None:
        gains = gains / arm.motor.torque_per_volt
    size = int(rng.choice([2, 3]))  # without the integral, or with it
    poles = np.poly([-1 / lag, -3 / lag, 0.0][:size])
    A = np.eye(size, k=-1)
    A[0] = -poles[1:]
    B, C, D = np.eye(size)[:, :1], -gains[None, :size] * 3 / lag**2, np.zeros((1, 1))
    step = delay = 0.0
    if sampled:
        step = float(10 ** rng.uniform(-2, 0.3) / hertz / 4)
        delay = step * float(rng.choice([0.0, 0.4, 1.0]))
        A, B, C, D = cont2discrete((A, B, C, D), step, "bilinear")[:4]
    law = Law(A, B, C, D, objective.sensors, objective.actuator, step)
    return _given(law, delay)


def options_of(rng: np.random.Generator, kind: str, hertz: float) -> Mapping[str, object]:
    """Return the options of a kind of design for an arm with this first frequency."""
    band = float(hertz * 10 ** rng.uniform(-1.5, 0.2))
    if kind == "sampled":
        step = float(10 ** rng.uniform(-2, 0.3) / hertz / 4)
        return {"sample_time": step, "delay": step * float(rng.choice([0.0, 0.3, 0.5, 1.0, 1.6]))}
    if kind == "integral":
        return {"integral_limit": float(10 ** rng.uniform(-1, 1) / hertz)}
    if kind == "pole-placement":
        return {"bandwidth_hz": band, "added_damping": {"1": float(rng.uniform(0.0, 0.3))},
                "observer_speed": float(rng.uniform(1.5, 5))}  # fmt: skip
    if kind == "pd-notch":
        return {"bandwidth_hz": band, "rolloff_hz": float(band * 10 ** rng.uniform(0.5, 1.5))}
    if kind == "positive-position":
        return {"bandwidth_hz": band, "gain": float(rng.uniform(0.05, 0.5))}
    return {"crossover_hz": band} if kind == "lead" else {}


def random_designs(
    seed: int,
    count: int,
    most_modes: int = 10,
    refused: Counter[str] | None = None,
    shares: Mapping[str, float] = SHARES,
) -> Iterator[Design]:
    """Yield so many designs; what could not be designed is counted and left out.

    Parameters
    ----------
    seed, count : int
    most_modes : int
        Truths keep from 6 to as many.
    refused : Counter, optional
    shares : mapping of str to float
        How often each kind is drawn.
    """
    rng = np.random.default_rng(seed)
    made = 0
    while made < count:
        kind = str(rng.choice(list(shares), p=list(shares.values())))
        arm, n, modes = (
            random_arm(rng),
            int(rng.integers(1, 5)),
            int(rng.integers(6, most_modes + 1)),
        )
        source = str(rng.choice(SOURCES))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                objective = random_objective(rng, arm, kind)
                base = sc.truth(arm, modes)
                hertz = float(base.omega[0]) / (2 * math.pi)
                if "companion" in kind:
                    source, n = "nothing", 0
                    controller = companion(rng, arm, objective, hertz, "sampled" in kind)
                else:
                    method = kind if kind in METHODS else "lqg"
                    model = design_model(base, objective, source, n)
                    controller = model.controller(method, options_of(rng, kind, hertz))
        except (sc.SlewctlError, RuntimeWarning) as error:
            if refused is not None:
                refused[f"{kind}: {type(error).__name__}"] += 1
            continue
        made += 1
        yield Design(arm, objective, controller, kind, source, n, modes)
