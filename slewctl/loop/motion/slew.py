"""A slew: the response of a closed loop to a smooth turn of the reference angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError

from slewctl._show import Axes, DataFrame, Described, axes_or_new, rows_of, to_frame
from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError, check_choice, check_count, check_type
from slewctl.loop.closed import Loop
from slewctl.loop.motion.continuous_motion import ContinuousMotion
from slewctl.loop.motion.extremes import Search, SlewMotion, Sought
from slewctl.loop.motion.sampled_motion import SampledMotion
from slewctl.loop.motion.slew_inputs import DEFLECTION, HUB_TORQUE, THETA, TIP, VOLTAGE, Slew
from slewctl.loop.sampled import SampledLoop
from slewctl.plant.signals import TORQUE

# The tip has settled within this part of its travel.
BAND = 0.02
# Parts of the travel that are rounding, and none of the tip's error.
_ROUNDING = 1e-12
# Less than this part of a limit beyond it is on it: the band's edge belongs to the band.
_EDGE = 1e-9


@dataclass(frozen=True)
class SlewSummary:
    """A slew in a few numbers, each of all times from its beginning on.

    They are found between bounds and not read from samples: none is missed, and they do not
    depend on the time or the number of points drawn.

    Attributes
    ----------
    settling_time_s : float
        When the tip comes within 2 % of its travel for good; infinite if it never does.
    residual_m : float
        Largest tip error after the reference has come to rest.
    peak_torque : float
        Largest |torque| on the hub in N·m.
    peak_voltage : float or None
        Largest |voltage| in V; None for an arm without a motor.
    saturates : bool
        Whether a peak exceeds a limit of motor or actuator: the slew as simulated, which
        knows no limits, is then not what the arm would do.
    overshoot : float
        How far the tip goes beyond its travel at most, as a fraction of it; 0 if it does not.
    energy_j : float or None
        Work of the actuator in J, driving and braking alike; None where the slew is not
        simulated.
    saturation_s : float or None
        Time in s for which the command was limited; None where the slew is not simulated.
    """

    settling_time_s: float
    residual_m: float
    peak_torque: float
    peak_voltage: float | None = None
    saturates: bool = False
    overshoot: float = 0.0
    energy_j: float | None = None
    saturation_s: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class SlewResponse(Described):
    """What the arm does during a slew.

    Attributes
    ----------
    t : ndarray
        Times in s.
    theta, tip, tip_deflection, torque : ndarray
        rad, m, m and N·m; the torque is the actuator's, lags and all, on the hub or the rotor.
    actuator : ndarray
        What the actuator makes of its command, a torque or the motor's voltage in V.
    tip_reference : ndarray
        (r + L) θ_ref in m.
    summary : SlewSummary
    """

    t: Array
    theta: Array
    tip: Array
    tip_deflection: Array
    torque: Array
    actuator: Array
    tip_reference: Array
    summary: SlewSummary

    @property
    def _unsettled(self) -> str:
        return "the tip does not settle"

    def __str__(self) -> str:
        s = self.summary
        volts = "" if s.peak_voltage is None else f", {s.peak_voltage:.4g} V"
        beyond = ", beyond the drive's limits" if s.saturates else ""
        still = np.isfinite(s.settling_time_s)
        settled = f"settled after {s.settling_time_s:.4g} s" if still else self._unsettled
        return (
            f"slew: {settled}, residual {s.residual_m:.3g} m, "
            f"peak {s.peak_torque:.4g} N·m{volts}{beyond}"
        )

    def to_frame(self) -> DataFrame:
        """Return the curves as a pandas data frame, one time a row."""
        names = ("t", "theta", "tip", "tip_deflection", "torque", "tip_reference")
        return to_frame(rows_of({name: getattr(self, name) for name in names}))

    def plot(self, what: str = "tip", ax: Axes | None = None) -> Axes:
        """Draw one curve over time.

        Parameters
        ----------
        what : {"tip", "error", "torque", "actuator"}
            The tip and where it should be, in m; the difference; the torque on the hub in
            N·m; what the actuator applies, in N·m or V.
        ax : matplotlib Axes, optional
            By default those of a new figure.

        Raises
        ------
        InputError
            For another curve.
        """
        curves = {
            "tip": (self.tip, "tip (m)"),
            "error": (self.tip - self.tip_reference, "tip error (m)"),
            "torque": (self.torque, "torque on the hub (N·m)"),
            "actuator": (self.actuator, "actuator (N·m or V)"),
        }
        values, label = curves[check_choice(what, curves, "what")]
        ax = axes_or_new(ax)
        if what == "tip":
            ax.plot(self.t, self.tip_reference, lw=4, alpha=0.4, label="wanted")
        ax.plot(self.t, values, label=what)
        ax.set_xlabel("time (s)")
        ax.set_ylabel(label)
        ax.legend()
        return ax


@single_threaded
def simulate_slew(loop: Loop, slew: Slew, points: int = 401) -> SlewResponse:
    """Return the response of a stable loop to `slew`.

    The controller is given y − y_ref, where y_ref is what each sensor would read on a rigid
    arm; the torque J θ̈_ref + c θ̇_ref that would turn the rigid arm is added, or the voltage
    that makes the motor give it.  c is the drag on the rigid rotation: the friction at the
    hub and the mass-proportional damping.

    A sampled controller is given y − y_ref of each sampling instant.  The torque added to
    what it computes at t_k is the mean of the same expression over the time that it is held,
    from t_k + delay to t_{k+1} + delay.

    Parameters
    ----------
    loop : Loop
    slew : Slew
    points : int
        Number of times of the curves, at least 3; the response is exact at each of them.
        Of a sampled loop they are about so many of the samples and times between them.
        The summary is of all times, however few are drawn.

    Returns
    -------
    SlewResponse

    Raises
    ------
    UnstableLoopError
        If the loop is unstable.
    InputError
        For less than three points, or a slew that `simulate` alone can take.
    AccuracyError
        If the extremes are not found with a reasonable amount of work, or the numbers leave
        the range, or the digits, of floating point.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01})
    >>> plant = problem.plant("clamped-free", n=1)
    >>> loop = problem.judge(sc.lqg(plant)).loop
    >>> response = sc.simulate_slew(loop, sc.Slew(angle_deg=30.0, duration_s=4.0), points=5)
    >>> response.t.tolist()
    [0.0, 4.0, 6.666666666666666, 9.333333333333332, 12.0]
    """
    check_type(slew, Slew, "slew")
    loop.require_stable("a slew response")
    if not slew.exact:
        raise InputError(
            "a slew with another profile, a shaper or conditions is simulated in steps",
            where="simulate_slew",
            remedy="use problem.simulate, or slewctl.simulate with a loop",
        )
    check_count(points, "points", 3)
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            return _response(loop, slew, points)
    except (ArithmeticError, LinAlgError) as error:
        raise AccuracyError(
            f"the response to a slew of {slew.angle_deg:g} degrees in {slew.duration_s:g} s "
            "leaves the range of the numbers",
            where="slew",
            remedy="give the duration in seconds, and every part of the arm in SI units",
        ) from error


def _response(loop: Loop, slew: Slew, points: int) -> SlewResponse:
    moved: SlewMotion = (
        SampledMotion(loop, slew) if isinstance(loop, SampledLoop) else ContinuousMotion(loop, slew)
    )
    t, found = moved.curves(slew.end, points)
    commanded = HUB_TORQUE if loop.objective.actuator == TORQUE else VOLTAGE
    reach = loop.model.arm.reach
    return SlewResponse(
        t,
        found[THETA],
        found[TIP],
        found[DEFLECTION],
        found[HUB_TORQUE],
        found[commanded],
        reach * slew.reference(t)[0],
        _summary(loop, slew, moved, reach * float(np.radians(slew.angle_deg))),
    )


def _summary(loop: Loop, slew: Slew, moved: SlewMotion, travel: float) -> SlewSummary:
    search, size = Search(), abs(travel)
    motor = loop.model.arm.motor
    # The tip's error late, beyond its travel, and always; then torque and voltage.
    signals = [TIP, TIP, HUB_TORQUE, VOLTAGE][: 3 if motor is None else 4]
    of_tip = np.array([float(signal == TIP) for signal in signals])
    sense, since = np.zeros(len(signals)), np.zeros(len(signals))
    since[0], sense[1] = slew.duration_s, np.sign(travel)
    floor = _ROUNDING * size * of_tip
    sought = Sought(np.array(signals), travel * of_tip, sense, since, floor)
    residual, beyond, torque, *voltage = search.highest(moved, sought).tolist()
    error = Sought(np.array([TIP]), np.array([travel]), np.zeros(1), np.zeros(1), floor[:1])
    settled = search.last_outside(moved, error, BAND * size * (1 + _EDGE))
    overshoot = beyond / size if beyond > _EDGE * size else 0.0
    saturates = bool(loop.model.arm.exceeded(torque, *voltage))
    peaks = (torque, voltage[0] if voltage else None)
    return SlewSummary(settled, residual, *peaks, saturates, overshoot)
