"""What a computer runs every sample, before it is written in any language.

    v  = C x + D y + D_r θ_r + feedforward
    u  = v, cut off at ± the limit
    x⁺ = x + (A − I) x + B y + B_r θ_r + H (u − v)

in modal sections.  A reading that is no number is replaced by the last one that was, as long
as the loop's delay margin forgives it; then, and where a reading stands still at full command,
the program gives nothing any more and says why.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from slewctl._types import Array
from slewctl.compare import Judgement, digital_loss, least_word, loop_signals, read
from slewctl.design import Controller
from slewctl.design.anti_windup import anti_windup, fading, winding
from slewctl.design.digital.arithmetic import Arithmetic
from slewctl.design.digital.sections import in_sections
from slewctl.design.reference import Reference, rigid_readings
from slewctl.embedded.at_rest import entry_of, settled, starting_states
from slewctl.embedded.options import CodeOptions
from slewctl.embedded.sample_time import check_sampled
from slewctl.loop.tracking import tracking_controller
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.signals import signal

# More readings in a row that are none no delay margin is asked to forgive.
_MOST_MISSED = 1000
UNITS = {"torque": "N*m", "voltage": "V"}
# Words that C and C++ have for themselves, as far as a design might be called so.
_TAKEN = re.compile(
    "auto|break|case|char|class|const|continue|default|delete|do|double|else|enum|explicit|extern"
    "|false|float|for|friend|goto|if|inline|int|long|main|new|operator|private|public|register"
    "|return|short|signed|sizeof|static|struct|switch|template|this|true|try|typedef|union"
    "|unsigned|using|virtual|void|volatile|while"
)


@dataclass(frozen=True, eq=False)
class Program:
    """A sampled controller as it runs.

    Attributes
    ----------
    name : str
        A name in C.
    controller : Controller
        In sections, with the coefficients as they are rounded.
    reference : Reference
        How the reference angle enters.
    windup : ndarray, shape (n,)
        H, zero where nothing is cut off.
    start : ndarray, shape (n,)
        States at rest at an angle of 1 rad.
    at_rest : ndarray, shape (sensors,)
        Readings there.
    limit : float
        Of the command, where drive or words end; infinite without one.
    most_missed : int
        How many readings in a row may be missing.
    most_still : int
        How many samples a reading may stand still at full command; zero for any number.
    options : CodeOptions
    notes : tuple of str
        What is said of it at the head of the file.
    amplitudes : ndarray, shape (sensors + 2,)
        Sizes of readings, reference and feedforward to try it with.
    """

    name: str
    controller: Controller
    reference: Reference
    windup: Array
    start: Array
    at_rest: Array
    limit: float
    most_missed: int
    most_still: int
    options: CodeOptions
    notes: tuple[str, ...]
    amplitudes: Array

    @property
    def system(self) -> LinearSystem:
        """From the sensors to the actuator."""
        return self.controller.linear

    @property
    def words(self) -> Arithmetic | None:
        """The words of fixed point; None where numbers have a floating one."""
        found = self.controller.arithmetic
        return found if found is not None and found.kind == "fixed" else None

    @property
    def actuator(self) -> str:
        """What it commands."""
        return self.system.output_labels[0]

    @property
    def sensors(self) -> tuple[str, ...]:
        """What it reads."""
        return tuple(self.system.input_labels)

    @property
    def identifiers(self) -> tuple[str, ...]:
        """Its sensors as names in C."""
        return tuple(identifier(name) for name in self.sensors)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each reading, in letters that C's comments have."""
        return tuple(_plain(signal(name).unit) for name in self.sensors)


def identifier(text: str) -> str:
    """Return a name in C and C++ that reads like a text.

    Examples
    --------
    >>> identifier("06-sampled lqg"), identifier("double")
    ('sampled_lqg', 'double_')
    """
    found = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower().lstrip("0123456789_")
    found = found or "controller"
    return f"{found}_" if _TAKEN.fullmatch(found) else found


def _plain(text: str) -> str:
    return text.replace("·", "*").replace("²", "^2").replace("√", "sqrt ")


def program_of(
    judgement: Judgement,
    options: CodeOptions,
    name: str = "controller",
    notes: tuple[str, ...] = (),
) -> Program:
    """Return what a computer runs of a judged controller.

    Parameters
    ----------
    judgement : Judgement
        Of a sampled controller whose loop on the truth is stable.
    options : CodeOptions
    name : str
    notes : tuple of str
        Where it comes from.

    Returns
    -------
    Program

    Raises
    ------
    InputError
        For a continuous controller, with a sample time that suits it; for options that name
        no signal of it.
    UnstableLoopError
        If the loop is not stable.
    DesignError
        If no word holds it.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> from slewctl.embedded import CodeOptions, program_of
    >>> program_of(problem.judge(K), CodeOptions("float"), "arm").controller.arithmetic.kind
    'float'
    """
    given = judgement.controller
    check_sampled(judgement)
    judgement.loop.require_stable("a program")
    options.check_reversed(given.sensors, given.linear.output_labels[0])
    controller, said = _in_numbers(judgement, options)
    model = judgement.loop.model
    told = tracking_controller(controller, model)
    reference = entry_of(told)
    at_rest = rigid_readings(model, controller.sensors)
    exact = entry_of(tracking_controller(given, model))
    if controller.arithmetic is not None and not starting_states(given.linear, exact, at_rest)[1]:
        reference = settled(controller.linear, reference, at_rest)
    limit = model.arm.command_limit(controller.linear.output_labels[0])
    system, n = controller.linear, controller.linear.nstates
    ends = limit
    if controller.arithmetic is not None and controller.arithmetic.kind == "fixed":
        words = controller.arithmetic
        ends = min(limit, math.ldexp(words.largest, -words.command))
    H, left = np.zeros((n, 1)), ""
    if math.isfinite(ends):
        H = anti_windup(given)[0][:, None]
        # Of the law itself: rounding lets its integrators leak, and not to any use.
        left = winding(given.linear.A, given.linear.C, H[:, 0], given.sample_time)
        H = H if controller is given else in_sections(given.linear).of_state(H)
    start, jump = starting_states(system, reference, at_rest)
    seen = loop_signals(judgement).largest
    room = np.array([*seen[:-2], seen[-1], seen[-2]])
    said = (*said, _said_of_limit(system, H, ends, limit, left), *([jump] if jump else []))
    return Program(
        identifier(name), controller, reference, H[:, 0], start, at_rest, ends,
        _missed(judgement), _still(judgement, options, limit), options, (*notes, *said), room,
    )  # fmt: skip


def _in_numbers(judgement: Judgement, options: CodeOptions) -> tuple[Controller, tuple[str, ...]]:
    """Return the controller in sections, rounded as asked, and what that takes from it."""
    given = judgement.controller
    if given.arithmetic is not None:  # rounded already
        return given, (str(given.arithmetic),)
    if options.arithmetic == "double":
        return given.in_sections(), ("double precision",)
    if options.arithmetic == "float":
        made = given.in_float32()
        loss = digital_loss(judgement, judgement.yardstick.judge(made, judgement.slew))
    elif options.word is None:
        made, loss = least_word(judgement)
    else:
        made = given.in_fixed_point(options.word, options.fraction, loop_signals(judgement))
        loss = digital_loss(judgement, judgement.yardstick.judge(made, judgement.slew))
    return made, (f"{made.arithmetic}: {loss}",)


def _said_of_limit(system: LinearSystem, H: Array, ends: float, limit: float, left: str) -> str:
    if not math.isfinite(ends):
        return "no limit of the command is known: it is not cut off"
    told = f"the command is cut off at {ends:g} {UNITS[system.output_labels[0]]}"
    if not math.isfinite(limit):
        told = f"no limit of the command is known: where its words end {told}"
    if left:
        return f"{told}, and {left} winds up meanwhile: nothing leads it back"
    if not system.nstates:
        return f"{told}; nothing winds up"
    lasting = fading(system.A - H @ system.C, system.sample_time)
    if not lasting:
        return f"{told}, which the states know at once"
    if math.isinf(lasting):  # what the command does not show
        return f"{told}, which the states are told"
    return f"{told}, after which the states settle with a time constant of {lasting:.3g} s"


def _missed(judgement: Judgement) -> int:
    """Return how many samples the loop can do without a new reading."""
    margin = read(judgement, "delay_margin_s").value
    if not math.isfinite(margin):
        return _MOST_MISSED
    return min(int(margin / judgement.controller.sample_time), _MOST_MISSED)


def _still(judgement: Judgement, options: CodeOptions, limit: float) -> int:
    """Return for how many samples at full command a reading may stand still; zero for any."""
    if not math.isfinite(limit) or options.stuck_s == 0:
        return 0
    frequencies = judgement.loop.model.frequencies_hz
    flexible = frequencies[frequencies > 0]
    if options.stuck_s is None and not len(flexible):
        return 0
    stuck = options.stuck_s if options.stuck_s is not None else 1 / float(flexible[0])
    return max(math.ceil(stuck / judgement.controller.sample_time), 2)
