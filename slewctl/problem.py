"""The face of it all: an arm, what is asked of it, and what a controller makes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from typing import Any

from slewctl.arm import Arm, ModalData
from slewctl.arm.parts import arm_table
from slewctl.basis import MODAL, Basis
from slewctl.compare.case import DEFAULT_SLEW, MOST_TRUTH_MODES
from slewctl.compare.judged import Judged
from slewctl.compare.judgement import Yardstick, shaped_for
from slewctl.compare.loss_of_digits import DigitalLoss, digital_loss, least_word, loop_signals
from slewctl.design import Controller
from slewctl.design.digital.fixed_point import LoopSignals
from slewctl.design.methods import GIVEN
from slewctl.errors import InputError, check_count
from slewctl.export import toml_text
from slewctl.loop import Conditions, Simulation, Slew, close, simulate
from slewctl.loop.parts import System
from slewctl.model import Truth, assemble, truth
from slewctl.model.assembly import check_arm
from slewctl.model.converged_truth import DEFAULT_MODES
from slewctl.plant import GeneralisedPlant, Objective, generalised_plant


@dataclass(frozen=True, eq=False)
class Problem:
    """An arm, what is kept small, and what disturbs and is measured.

    Parameters
    ----------
    arm : Arm
    limits : mapping of str to float
        Largest acceptable values of outputs and of the actuator, ``torque`` (N·m) or
        ``voltage`` (V); see `Objective`.
    noise : mapping of str to float
        Of the torque disturbance (N·m/√Hz) and of each sensor (its unit/√Hz); see `Objective`.
        `encoder_noise` returns that of an encoder.
    slew : Slew
        The turn by which settling, overshoot and peaks are judged.
    truth_modes : int
        Flexible modes of the truth that judges.  Verdicts are followed to twice as many and
        more.

    Raises
    ------
    InputError
        For what `Objective` refuses, or a truth of no or too many modes.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.005)
    >>> problem = sc.Problem(arm, limits={"tip": 0.03, "torque": 1.0},
    ...                      noise={"torque": 0.1, "theta": 0.01, "theta_dot": 0.1})
    >>> judged = problem.judge(sc.lqg(problem.plant("clamped-free", n=2)))
    >>> judged.stable, round(judged.margins.phase_deg.value)
    (True, 33)
    """

    arm: Arm
    limits: Mapping[str, float]
    noise: Mapping[str, float]
    slew: Slew = DEFAULT_SLEW
    truth_modes: int = DEFAULT_MODES

    def __post_init__(self) -> None:
        check_arm(self.arm, "arm")
        objective = Objective(self.limits, self.noise)
        object.__setattr__(self, "limits", objective.limits)
        object.__setattr__(self, "noise", objective.noise)
        if check_count(self.truth_modes, "truth_modes") > MOST_TRUTH_MODES:
            raise InputError(
                f"a truth of {self.truth_modes} modes cannot be judged on twice as many",
                where="truth_modes",
                remedy=f"keep at most {MOST_TRUTH_MODES}",
            )

    def __repr__(self) -> str:
        small = ", ".join(f"{name} {value:g}" for name, value in self.limits.items())
        noisy = ", ".join(f"{name} {value:g}" for name, value in self.noise.items())
        return f"<problem of {self.arm.name}: limits {small}; noise {noisy}>"

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self))}</p>{self.truth._repr_html_()}"

    @cached_property
    def objective(self) -> Objective:
        """Limits and noise as one, for the functions beneath."""
        return Objective(self.limits, self.noise)

    @property
    def truth(self) -> Truth:
        """The converged model of the arm."""
        return self._yardstick.model

    @cached_property
    def _yardstick(self) -> Yardstick:
        return Yardstick(truth(self.arm, self.truth_modes), self.objective)

    def plant(self, basis: Basis | str, n: int | None = None) -> GeneralisedPlant:
        """Return what a controller is designed on: a small model with the problem's weights.

        Parameters
        ----------
        basis : Basis or str
            Such as ``ClampedFree(2)``, or its name with `n`.
        n : int, optional
            Number of admissible functions, where the basis is given by name.

        Returns
        -------
        GeneralisedPlant
            2(n + 1) states, in modal coordinates.
        """
        return generalised_plant(assemble(self.arm, basis, n), self.objective)

    @property
    def optimum(self) -> Controller:
        """The H2-optimal controller of the truth itself: nothing costs less."""
        return self._yardstick.optimum()

    def judge(
        self,
        controller: Controller | System,
        slew: Slew | None = None,
        *,
        sign: int | None = None,
    ) -> Judged:
        """Return what a controller achieves on the truth, on finer truths and beside the optimum.

        Parameters
        ----------
        controller : Controller or control.StateSpace
            A design's result; or a system of your own from the sensors to the actuator, by
            name, or by position where it has no names.
        slew : Slew, optional
            Another turn than the problem's; its shaper is made for this loop.
        sign : {-1, 1}, optional
            Of the feedback of a system of your own, −1 unless told otherwise, as in
            `slewctl.margins` and `control.feedback`; a `Controller` has its minus inside.

        Raises
        ------
        InputError
            If the controller takes other sensors than are measured, or commands another
            actuator; for a sign that is none, or contradicts a `Controller`.
        """
        yardstick = self._yardstick
        loop = close(yardstick.model, self.objective, controller, sign=sign)
        return Judged(loop, yardstick, shaped_for(slew or self.slew, loop))

    def simulate(
        self,
        controller: Controller | System,
        command: Slew | None = None,
        *,
        conditions: Conditions | None = None,
        step: float | None = None,
        sign: int | None = None,
    ) -> Simulation:
        """Return a slew on the truth as it happens, step by step.

        Parameters
        ----------
        controller : Controller or control.StateSpace
            As for `judge`.
        command : Slew, optional
            By default the problem's own; its shaper, if it is but named, is made for the loop.
        conditions : Conditions, optional
            Instead of the command's own: limits, friction, play, encoder, clock, noise, loads.
        step : float, optional
            The longest one in s; see `slewctl.simulate`.
        sign : {-1, 1}, optional
            As for `judge`.

        Returns
        -------
        Simulation
            Times, signals by name, measures, seed; it draws itself.

        Raises
        ------
        UnstableLoopError
            If the loop is unstable.
        InputError
            As `judge`; for conditions that the loop does not have, or a shaper that cannot be
            made.

        Examples
        --------
        >>> import slewctl as sc
        >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01,
        ...              actuator=sc.Actuator(torque_limit=0.25))
        >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0},
        ...                      {"torque": 0.1, "theta": 0.01}, slew=sc.Slew(30.0, 4.0))
        >>> K = sc.lqg(problem.plant("clamped-free", n=1))
        >>> result = problem.simulate(K, conditions=sc.Conditions(saturate=True))
        >>> bool(abs(result.signals["torque"]).max() <= 0.25)
        True
        """
        slew = command or self.slew
        if conditions is not None:
            slew = replace(slew, conditions=conditions)
        loop = close(self.truth, self.objective, controller, sign=sign)
        return simulate(loop, slew, step=step)

    def digital_loss(self, before: Controller, after: Controller) -> DigitalLoss:
        """Return what a step on the way to the computer takes from a controller, on the truth.

        Parameters
        ----------
        before : Controller
        after : Controller
            Such as ``before.discretised(0.01)``, ``before.reduced(4, plant)`` or
            ``before.in_float32()``.

        Raises
        ------
        UnstableLoopError
            If the loop is not stable to begin with.

        Examples
        --------
        >>> import slewctl as sc
        >>> arm = sc.Arm(sc.arms.paper_beam().beam, hub=sc.Hub(inertia=0.2), damping_ratio=0.01)
        >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
        >>> K = sc.lqg(problem.plant("clamped-free", n=1))
        >>> loss = problem.digital_loss(K, K.discretised(0.01))
        >>> 0.01 < loss.margin < 0.2, 0 < loss.cost < 0.1
        (True, True)
        """
        return digital_loss(self.judge(before), self.judge(after))

    def loop_signals(self, controller: Controller) -> LoopSignals:
        """Return what a sampled controller's signals come to on the truth, slew and noise.

        `Controller.in_fixed_point` scales by them.

        Parameters
        ----------
        controller : Controller
        """
        return loop_signals(self.judge(controller))

    def least_word(
        self, controller: Controller, loss: float = 0.01
    ) -> tuple[Controller, DigitalLoss]:
        """Return a sampled controller in the shortest words that lose no more than a part of it.

        Parameters
        ----------
        controller : Controller
        loss : float
            Largest relative fall of a margin, and rise of the cost.

        Raises
        ------
        DesignError
            If no word of up to 32 bits loses so little.
        """
        return least_word(self.judge(controller), loss)

    def to_toml(
        self,
        method: str = "lqg",
        *,
        basis: str | None = None,
        n: int | None = None,
        requirements: Mapping[str, float | bool] | None = None,
        title: str = "",
        **options: Any,
    ) -> str:
        """Return the problem as the text of a design file.

        Parameters
        ----------
        method : str
            Of `slewctl.design.METHODS`.
        basis, n : str, int, optional
            What the design is made on; by default two arm-matched functions, or modes of the
            arm's data.
        requirements : mapping of str to float, optional
            What the gate requires, by default that the loop is stable.
        title : str
        **options
            The method's own.

        Raises
        ------
        InputError
            If a profile of the arm is a function, which a file cannot hold.

        Examples
        --------
        >>> import slewctl as sc
        >>> problem = sc.Problem(sc.arms.paper_beam(), limits={"tip": 0.03, "torque": 1.0},
        ...                      noise={"torque": 0.1, "theta": 0.01})
        >>> text = problem.to_toml("pd-notch", bandwidth_hz=0.5)
        >>> text.splitlines()[-2:]
        ['[requirements]', 'stable = true']
        """
        data = self.arm.beam if isinstance(self.arm.beam, ModalData) else None
        basis = basis or (MODAL if data else "arm-matched")
        n = n or min(2, data.modes if data else 2)
        weights = {"limits": dict(self.limits), "noise": dict(self.noise)}
        return toml_text(
            {
                "title": title or None,
                "arm": arm_table(self.arm),
                "model": None if method == GIVEN else {"basis": basis, "n": n},
                "controller": {"method": method, **options, **weights},
                "slew": self.slew.table(),
                "truth": {"modes": self.truth_modes},
                "requirements": {"stable": True, **(requirements or {})},
            }
        )
