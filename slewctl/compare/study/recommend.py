"""Which basis, how many functions and how fast a controller: a small study of one's own arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from html import escape
from typing import Any

import numpy as np

from slewctl._show import Axes, DataFrame, axes_or_new, table_html, to_frame
from slewctl._threads import single_threaded
from slewctl.arm import Arm, require_beam
from slewctl.basis import NAMES
from slewctl.breakdown import computing
from slewctl.compare.judgement import Judgement
from slewctl.compare.reading import read
from slewctl.compare.study.answer import percent
from slewctl.compare.study.designs import GOOD
from slewctl.compare.study.grid import check_sensors, omega_of
from slewctl.compare.study.point import on_twice, place_of
from slewctl.design.clocked import read_clock
from slewctl.errors import DesignError, InputError, SlewctlError
from slewctl.model import beam_inertia

# Over the first flexible frequency, from slow to faster than any small model bears.
BANDWIDTHS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5)
# Of the design models: a controller of more than 14 states is no small one.
ORDERS = (1, 2, 3, 4, 5, 6)
# Classical rules of thumb for a loop that someone will run.
LEAST_GAIN_DB = 6.0
LEAST_PHASE_DEG = 30.0


@dataclass(frozen=True)
class Trial:
    """LQG on n functions of a basis at one bandwidth, judged on the truth.

    Attributes
    ----------
    basis : str
    n : int
    bandwidth : float
        ω_c over the first flexible frequency.
    bandwidth_hz : float
    stable : bool
        On the truth and on one of twice the modes.
    loss, gain_margin_db, phase_margin_deg : float or None
    accepted : bool
        Stable, at most 5 % lost, at least 6 dB and 30°.
    """

    basis: str
    n: int
    bandwidth: float
    bandwidth_hz: float
    stable: bool
    loss: float | None
    gain_margin_db: float | None
    phase_margin_deg: float | None
    accepted: bool


@dataclass(frozen=True)
class Recommendation:
    """What to pick for an arm, with the evidence.

    Attributes
    ----------
    arm : str
    hub_ratio : float
        Hub inertia over the beam's about the axis.
    sensors : tuple of str
    basis : str
    n : int
    bandwidth_hz : float
        Up to here every slower design tried on that basis and n was accepted as well.
    trials : tuple of Trial
    damping : str
        Where the arm's damping comes from, if that was told.
    sample_time, delay : float
        In s, of the controllers; zero for continuous ones.
    """

    arm: str
    hub_ratio: float
    sensors: tuple[str, ...]
    basis: str
    n: int
    bandwidth_hz: float
    trials: tuple[Trial, ...]
    damping: str = ""
    sample_time: float = 0.0
    delay: float = 0.0

    def __str__(self) -> str:
        return (
            f"{self.arm} (hub inertia {self.hub_ratio:.3g} of the beam's, measuring "
            f"{', '.join(self.sensors)}): take the {self.basis} basis with n = {self.n}, and a "
            f"bandwidth of at most {self.bandwidth_hz:.3g} Hz.  Up to there LQG designs"
            f"{self._clock} are "
            f"stable on the converged arm, lose at most {percent(GOOD)} of the optimal cost and "
            f"keep {LEAST_GAIN_DB:g} dB and {LEAST_PHASE_DEG:g} deg."
            + (f"  Damping ratio {self.damping}." if self.damping else "")
        )

    @property
    def _clock(self) -> str:
        if not self.sample_time:
            return ""
        return (
            f" with a clock of {1e3 * self.sample_time:g} ms and {1e3 * self.delay:g} ms of delay"
        )

    def _repr_html_(self) -> str:
        orders = sorted({trial.n for trial in self.trials})
        limits = [
            {"basis": basis, **{f"n = {n}": self.limit(basis, n) or None for n in orders}}
            for basis in dict.fromkeys(trial.basis for trial in self.trials)
        ]
        return f"<p>{escape(str(self))}</p>" + table_html(limits, "bandwidth limit in Hz")

    def to_frame(self) -> DataFrame:
        """Return the trials as a pandas data frame."""
        return to_frame([asdict(trial) for trial in self.trials])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the bandwidth limit of every basis over the number of functions.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            By default those of a new figure.
        """
        ax = axes_or_new(ax)
        orders = sorted({trial.n for trial in self.trials})
        for basis in dict.fromkeys(trial.basis for trial in self.trials):
            ax.plot(orders, [self.limit(basis, n) for n in orders], "o-", label=basis)
        ax.set_xlabel("functions n")
        ax.set_ylabel("bandwidth limit (Hz)")
        ax.set_title(self.arm)
        ax.legend()
        return ax

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON knows it; infinite margins are None."""
        return {
            **asdict(self),
            "trials": [
                {k: None if v == math.inf else v for k, v in asdict(trial).items()}
                for trial in self.trials
            ],
        }

    def limit(self, basis: str, n: int) -> float:
        """Return the bandwidth in Hz up to which a basis and n are good; zero for none."""
        return _limit([t for t in self.trials if (t.basis, t.n) == (basis, n)])


def count_trials() -> int:
    """Return how many times `recommend` calls `progress`.

    Returns
    -------
    int

    Examples
    --------
    >>> from slewctl.compare import count_trials
    >>> count_trials() > 1
    True
    """
    return len(NAMES) * len(ORDERS) * len(BANDWIDTHS)


@single_threaded
def recommend(
    arm: Arm,
    sensors: Sequence[str] = ("theta", "theta_dot"),
    *,
    truth_modes: int = 20,
    sample_time: float | None = None,
    delay: float = 0.0,
    damping: str = "",
    progress: Callable[[str], None] | None = None,
) -> Recommendation:
    r"""Return basis, number of functions and bandwidth limit for an arm, found by trying.

    LQG designs are made on every basis, order and bandwidth, and judged on the truth.  The
    recommendation is the largest bandwidth limit that any of them reaches, with the fewest
    functions, and of equals the simplest basis.

    Parameters
    ----------
    arm : Arm
    sensors : sequence of str
        Of ``theta``, ``theta_dot``, ``tip`` and ``tip_deflection``.
    truth_modes : int
    sample_time : float, optional
        Of the computer that runs the controller, in s; continuous by default.
    delay : float
        Time in s from a sample to the output that is computed from it.
    damping : str
        Where the arm's damping comes from, to be told with the result: that of a catalogue
        arm is `slewctl.arms.CATALOGUE`\ ``[name].damping``.
    progress : callable, optional

    Returns
    -------
    Recommendation

    Raises
    ------
    InputError
        For an unknown sensor, or an impossible clock.
    DesignError
        If no design is acceptable at any bandwidth; the message says what came closest.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> found = sc.recommend(arm, truth_modes=10)  # doctest: +SKIP
    >>> found.basis, found.n  # doctest: +SKIP
    """
    require_beam(arm.beam, "recommend")
    measured = check_sensors(sensors)
    clock = read_clock(sample_time, delay)
    require_clock(arm, sample_time)
    trials: list[Trial] = []
    refused: list[InputError] = []
    for bandwidth in BANDWIDTHS:
        hertz = omega_of(arm, bandwidth) / (2 * math.pi)
        for basis in NAMES:
            for n in ORDERS:
                if progress:
                    progress(f"{basis}, n = {n}, {hertz:.3g} Hz")
                try:
                    found = _evaluated(arm, bandwidth, measured, truth_modes, basis, n, clock)
                except InputError as error:
                    refused.append(error)
                    found = None
                trials.append(_trial(basis, n, bandwidth, hertz, found))
        if len(refused) == len(trials):  # no matter of bases, nor of n
            raise refused[0]
    ranked = sorted(
        ((basis, n) for n in ORDERS for basis in NAMES),
        key=lambda pair: -_limit([t for t in trials if (t.basis, t.n) == pair]),
    )
    basis, n = ranked[0]
    limit = _limit([t for t in trials if (t.basis, t.n) == (basis, n)])
    if limit == 0:
        raise _nothing_found(arm, trials, damping, bool(sample_time))
    ratio = arm.hub_inertia / beam_inertia(arm)
    return Recommendation(
        arm.name, ratio, measured, basis, n, limit, tuple(trials), damping, **clock
    )


def require_clock(arm: Arm, sample_time: float | None) -> None:
    """Refuse a clock that knows nothing of any bandwidth that is tried."""
    slowest = omega_of(arm, BANDWIDTHS[0]) / (2 * math.pi)
    if sample_time and 0.5 / sample_time < slowest:
        raise InputError(
            f"a clock of {sample_time:g} s knows nothing beyond {0.5 / sample_time:.3g} Hz, and "
            f"the slowest bandwidth tried is {slowest:.3g} Hz",
            where="sample_time",
            remedy=f"take at most {0.1 / slowest:.2g} s",
        )


def _evaluated(
    arm: Arm,
    bandwidth: float,
    sensors: tuple[str, ...],
    truth_modes: int,
    basis: str,
    n: int,
    clock: Mapping[str, float],
) -> Judgement | None:
    """Return an LQG design on the truth, None where there is none or it is not stable."""
    try:
        with computing():
            place = place_of(arm, bandwidth, sensors, truth_modes)
            judged = place.evaluate(basis, n, "lqg", clock).judgement
            return judged if judged.stable and on_twice(judged).stable else None
    except InputError:
        raise
    except SlewctlError:
        return None


def _trial(basis: str, n: int, bandwidth: float, hertz: float, found: Judgement | None) -> Trial:
    if found is None:
        return Trial(basis, n, bandwidth, hertz, False, None, None, None, False)
    loss, gain, phase = (
        read(found, name).value for name in ("h2_loss", "gain_margin_db", "phase_margin_deg")
    )
    accepted = loss <= GOOD and gain >= LEAST_GAIN_DB and phase >= LEAST_PHASE_DEG
    return Trial(basis, n, bandwidth, hertz, True, loss, gain, phase, accepted)


def _limit(trials: Sequence[Trial]) -> float:
    """Return the largest bandwidth below which every trial was accepted."""
    limit = 0.0
    for trial in sorted(trials, key=lambda t: t.bandwidth):
        if not trial.accepted:
            break
        limit = trial.bandwidth_hz
    return limit


def _nothing_found(arm: Arm, trials: Sequence[Trial], damping: str, sampled: bool) -> DesignError:
    holding = [t for t in trials if t.stable and t.loss is not None]
    closest = min(holding, key=lambda t: t.loss or 0.0, default=None)
    near = (
        f"; the closest is {closest.basis}, n = {closest.n} at {closest.bandwidth_hz:.3g} Hz, "
        f"which loses {percent(max(closest.loss or 0.0, 0.0))} "
        f"with {closest.gain_margin_db:.1f} dB and {closest.phase_margin_deg:.0f} deg"
        if closest
        else ""
    )
    undamped = not np.any(arm.damping_ratios(1)) and arm.damping is None
    return DesignError(
        f"no design for {arm.name} is stable with {LEAST_GAIN_DB:g} dB, {LEAST_PHASE_DEG:g} deg "
        f"and at most {percent(GOOD)} of the optimal cost lost{near}"
        + (f"; damping ratio {damping}" if damping else ""),
        where="recommend",
        remedy="give the arm its damping (damping_ratio in a TOML file): without any, a mode that "
        "the controller does not know is on the edge of stability"
        if undamped
        else "add a sensor, or give the arm the hub inertia that it has"
        + (", or take a faster clock" if sampled else ""),
    )
