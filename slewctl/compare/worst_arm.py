"""The worst arm within a box of uncertain properties, for a controller that stays as it is.

Payload, hub, stiffness and damping are never known exactly.  Each varied arm has its own
converged truth, on which the fixed controller is judged: an unstable arm is worse than any
stable one, and among the stable the one with the smallest margin is worst.  Corners, seeded
samples and a gradient-free search look for it; what they find is an arm that can be rerun,
not a proof that there is none worse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from types import MappingProxyType

import numpy as np

from slewctl._show import Tabular, table_html
from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.arm import Arm, vary
from slewctl.compare.arm_box import box_bounds
from slewctl.compare.case import DEFAULT_SLEW, Case
from slewctl.compare.evaluation import Judge
from slewctl.compare.judgement import Judgement, Yardstick
from slewctl.compare.quantities import QUANTITIES, UNWEIGHTED, WEIGHTED, Reading
from slewctl.compare.reading import read
from slewctl.compare.sobol import sobol_points
from slewctl.design import Controller
from slewctl.errors import InputError, check_choice, check_count, shown
from slewctl.loop import Loop, Slew
from slewctl.model import truth
from slewctl.model.converged_truth import DEFAULT_MODES
from slewctl.plant import Objective

# A coordinate this close to a bound, as a fraction of the range, is on it.
_ON_A_BOUND = 1e-6
_SMALLEST_STEP = 1e-4  # of the range: a search ends here; the worst is no better known by far
# The most arms that a search tries unless told.
_SEARCHED = 60


@dataclass(frozen=True, eq=False)
class VariedArm:
    """One arm of the box and what the controller achieves on it.

    Attributes
    ----------
    properties : mapping of str to float
    reading : Reading
        The quantity; on an unstable loop its fastest growth rate in 1/s, negative.
    stable : bool
    how : {"nominal", "corner", "sample", "search"}
    """

    properties: Mapping[str, float]
    reading: Reading
    stable: bool
    how: str

    @property
    def value(self) -> float:
        """The quantity, or how fast the unstable loop grows, as a negative number in 1/s."""
        return self.reading.value

    @property
    def growth_per_s(self) -> float | None:
        """How fast the loop grows in 1/s; None where it is stable, or nobody knows."""
        return -self.value if self.value < 0 and not self.stable else None

    @property
    def frequency_hz(self) -> float | None:
        """Where the value is reached, or where the loop is unstable."""
        return self.reading.frequency_hz

    @property
    def confirmed(self) -> bool:
        """Whether there is a value, and nothing speaks against it."""
        return not (self.reading.doubt or math.isnan(self.value))


@dataclass(frozen=True, eq=False)
class WorstCase(Tabular):
    """The worst arm found in a box.

    Attributes
    ----------
    quantity : str
    arm : Arm
        The worst arm, to be rerun: ``close(truth(arm, modes), objective, controller)``.
    worst : VariedArm
        The same arm among the trials.
    at_corner : bool
        Whether every property is at a bound.
    nominal : VariedArm
        The arm as it is, not counted among the trials; it need not lie in the box.
    trials : tuple of VariedArm
        All arms tried, in order.
    modes : int
        Flexible modes of the truths.
    """

    quantity: str
    arm: Arm
    worst: VariedArm
    at_corner: bool
    nominal: VariedArm
    trials: tuple[VariedArm, ...]
    modes: int

    @property
    def properties(self) -> Mapping[str, float]:
        """What was varied, and to which values, on the worst arm."""
        return self.worst.properties

    @property
    def value(self) -> float:
        """The quantity on the worst arm; of an unstable loop its growth rate, negative."""
        return self.worst.value

    @property
    def frequency_hz(self) -> float | None:
        """Where that value is reached."""
        return self.worst.frequency_hz

    @property
    def stable(self) -> bool:
        """Whether the loop is stable on the worst arm, and so on all that were tried."""
        return self.worst.stable

    @property
    def confirmed(self) -> bool:
        """Whether nothing speaks against the worst value."""
        return self.worst.confirmed

    def rows(self) -> list[dict[str, object]]:
        """Return one row for each arm tried; an unstable loop has no value, but a growth rate."""
        return [
            {**trial.properties, "stable": trial.stable,
             self.quantity: trial.value if trial.stable else None,
             "growth_per_s": trial.growth_per_s,
             "frequency_hz": trial.frequency_hz, "how": trial.how}
            for trial in self.trials
        ]  # fmt: skip

    def _repr_html_(self) -> str:
        varied = ", ".join(f"{name} = {value:.4g}" for name, value in self.properties.items())
        worst = [{"arm": varied, "stable": self.stable,
                  self.quantity: self.value if self.stable else None,
                  "growth_per_s": self.worst.growth_per_s,
                  "at a corner": self.at_corner}]  # fmt: skip
        return table_html(worst, f"the worst of {self.tried} arms")

    @property
    def tried(self) -> int:
        """How many arms were tried."""
        return len(self.trials)

    @property
    def unstable(self) -> int:
        """On how many of them the loop is unstable."""
        return sum(not trial.stable for trial in self.trials)

    def __str__(self) -> str:
        where = ", ".join(f"{name} = {value:.6g}" for name, value in self.properties.items())
        place = f" at {self.frequency_hz:.4g} Hz" if self.frequency_hz is not None else ""
        what, note = f"{self.quantity} {self.value:.4g}{place}", self.worst.reading.note
        if math.isnan(self.value):
            of = " on any of them" if all(math.isnan(t.value) for t in self.trials) else ""
            what = f"{self.quantity} has no value{of}: {note}"
        elif not self.stable:
            grows = self.worst.growth_per_s
            what = f"UNSTABLE{place}, growing at {grows:.3g} 1/s" if grows else note
        corner = "at a corner" if self.at_corner else "inside the box or on a face"
        return f"worst of {self.tried} arms: {what} ({corner}: {where})"


def good(trial: VariedArm, quantity: str) -> float:
    """Return the value, as a number that is the greater the better."""
    if math.isnan(trial.value):
        return -math.inf
    smaller = trial.stable and QUANTITIES[quantity].better == "smaller"
    return -trial.value if smaller else trial.value


@single_threaded
def worst_case(
    design: Case | Judge | Loop,
    box: Mapping[str, Sequence[float]],
    *,
    quantity: str = "disk_margin",
    samples: int = 32,
    searches: int = 2,
    evaluations: int | None = None,
    seed: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> WorstCase:
    """Return the worst arm found in a box around a design, the controller being fixed.

    Parameters
    ----------
    design : Case, Judge or Loop
        A case, whose controller is designed once for its own arm; who judges one, with the
        controller that it judges; or a loop of your own controller on a model of its arm.
    box : mapping of str to (float, float)
        Lowest and highest value of each uncertain property, by the names of `slewctl.vary`:
        for example ``{"payload_mass": (0.0, 0.2), "stiffness_factor": (0.9, 1.1)}``.
    quantity : str
        What is to be good: a key of `QUANTITIES`.  Stability comes first in any case; a loop
        without a case makes the slew of one.
    samples : int
        Arms inside of the box, of a Sobol sequence with a random shift.
    searches, evaluations : int
        Nelder–Mead searches from the worst arms so far, and the most arms that each may try,
        by default 60.
    seed : int
        Of the samples, by default 0: the same arguments give the same answer.
    progress : callable, optional
        Called with a short text before each arm.

    Returns
    -------
    WorstCase

    Raises
    ------
    InputError
        For an unknown property or quantity, a range that is empty or impossible for the arm,
        a property that is given in the box twice, as a value and as a factor, a seed without
        samples or evaluations without searches, or a cost of what nothing weighs.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> loop = problem.judge(sc.lqg(plant)).loop
    >>> worst = sc.worst_case(loop, {"payload_mass": [0.0, 0.1]}, samples=2, searches=0)
    >>> worst.worst.value <= worst.nominal.value
    True
    """
    check_choice(quantity, QUANTITIES, "quantity")
    counts = (
        check_count(samples, "samples", 0),
        check_count(searches, "searches", 0),
        check_count(_SEARCHED if evaluations is None else evaluations, "evaluations", 1),
        check_count(0 if seed is None else seed, "seed", 0),
    )
    for name, value, count in (("seed", seed, samples), ("evaluations", evaluations, searches)):
        if value is not None and not count:
            raise InputError("means nothing where none are made", where=name, remedy="leave it out")
    subject = _Subject.of(design)
    if QUANTITIES[quantity].kind in WEIGHTED and not subject.objective.weighted:
        raise InputError(UNWEIGHTED, where="quantity", remedy="ask for a margin, or add them")
    low, high = box_bounds(box, subject.arm)
    search = _Search(subject, tuple(box), low, high, quantity, progress or _quiet)
    nominal = search.nominal()
    for corner in product((0.0, 1.0), repeat=len(low)):
        search.try_at(np.array(corner), "corner")
    if counts[0]:
        for point in sobol_points(len(low), counts[0], counts[3]):
            search.try_at(point, "sample")
    search.descend(counts[1], counts[2])
    return search.result(nominal)


def most_arms(properties: int, samples: int, searches: int, evaluations: int | None) -> int:
    """Return how many arms `worst_case` tries at the most, the nominal one included."""
    searched = _SEARCHED if evaluations is None else evaluations
    return 1 + 2**properties + samples + searches * searched


def _quiet(_: str) -> None:
    return None


@dataclass(frozen=True, eq=False)
class _Subject:
    """What is judged: a controller, its objective, and the arm that it was made for."""

    arm: Arm
    objective: Objective
    controller: Controller
    slew: Slew
    modes: int

    @staticmethod
    def of(design: Case | Judge | Loop) -> _Subject:
        if isinstance(design, Case):
            return _Subject.of(Judge(design))
        if isinstance(design, Judge):
            case, own = design.case, design.own[1]
            return _Subject(case.arm, case.objective, own, design.slew, case.truth_modes)
        if isinstance(design, Loop):
            arm, modes = design.model.arm, max(design.model.n, DEFAULT_MODES)
            return _Subject(arm, design.objective, design.controller, DEFAULT_SLEW, modes)
        raise InputError(
            f"{shown(design)} is neither a Case nor a Loop",
            where="worst_case",
            remedy="give a case, or slewctl.close(model, objective, controller)",
        )

    def judge(self, arm: Arm) -> Judgement:
        return Yardstick(truth(arm, self.modes), self.objective).judge(self.controller, self.slew)


@dataclass(eq=False)
class _Search:
    """The arms tried so far; points are in the unit cube."""

    subject: _Subject
    names: tuple[str, ...]
    low: Array
    high: Array
    quantity: str
    progress: Callable[[str], None]
    trials: list[VariedArm] = field(default_factory=list)
    points: list[Array] = field(default_factory=list)
    known: dict[tuple[float, ...], VariedArm] = field(default_factory=dict)

    def properties(self, point: Array) -> dict[str, float]:
        values = self.low + point * (self.high - self.low)
        values = np.where(point >= 1, self.high, values)  # a corner is a corner, to the last bit
        return {name: float(value) for name, value in zip(self.names, values, strict=True)}

    def nominal(self) -> VariedArm:
        return self._judged(self.subject.arm, {}, "nominal")

    def try_at(self, point: Array, how: str) -> VariedArm:
        """Return the trial at a point, which is clipped to the cube."""
        point = np.clip(point, 0.0, 1.0)
        properties = self.properties(point)
        key = tuple(properties.values())
        if key not in self.known:
            trial = self._judged(vary(self.subject.arm, **properties), properties, how)
            self.trials.append(trial)
            self.points.append(point)
            self.known[key] = trial
        return self.known[key]

    def _judged(self, arm: Arm, properties: dict[str, float], how: str) -> VariedArm:
        self.progress(f"{how} {', '.join(f'{k} = {v:.4g}' for k, v in properties.items())}".strip())
        judged = self.subject.judge(arm)
        reading = read(judged, self.quantity)
        if not (loop := judged.loop).stable:
            growth = 0.0 if loop.undecided else max(float(judged.poles.real.max()), 0.0)
            reading = reading._replace(value=-growth, note=loop.loud_fault)
        return VariedArm(MappingProxyType(properties), reading, judged.stable, how)

    def rank(self, k: int) -> tuple[bool, float]:
        """What makes a trial worse: unstable before stable, then the worse value."""
        return self.trials[k].stable, good(self.trials[k], self.quantity)

    def descend(self, searches: int, evaluations: int) -> None:
        """Search on from the worst arms so far, downhill without gradients."""
        from scipy.optimize import minimize  # slow to load: not before it is wanted

        starts = sorted(range(len(self.trials)), key=self.rank)[:searches]
        heights = [good(t, self.quantity) for t in self.trials if t.stable and np.isfinite(t.value)]
        # Stands for infinite values, which are no slope to descend.
        most = 10 * max(map(abs, heights), default=1.0) + 1.0

        def height(point: Array) -> float:
            trial = self.try_at(point, "search")
            return float(np.clip(good(trial, self.quantity), -most, most)) - (
                0 if trial.stable else 2 * most
            )

        for k in starts:
            start = self.points[k]
            inward = np.where(start < 0.5, 0.25, -0.25)
            simplex = np.vstack([start, start + np.diag(inward)])
            minimize(
                height,
                start,
                method="Nelder-Mead",
                bounds=[(0.0, 1.0)] * len(start),
                options={
                    "initial_simplex": simplex,
                    "maxfev": evaluations,
                    "xatol": _SMALLEST_STEP,
                    "fatol": 0.0,
                },
            )

    def result(self, nominal: VariedArm) -> WorstCase:
        k = min(range(len(self.trials)), key=self.rank)
        worst, point = self.trials[k], self.points[k]
        return WorstCase(
            self.quantity,
            vary(self.subject.arm, **worst.properties),
            worst,
            bool(np.all((point <= _ON_A_BOUND) | (point >= 1 - _ON_A_BOUND))),
            nominal,
            tuple(self.trials),
            self.subject.modes,
        )
