"""A log of a slew beside its prediction: how well they agree, and where they part."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slewctl._show import Axes, Tabular, axes_or_new
from slewctl._types import Array
from slewctl.errors import InputError
from slewctl.loop.motion.simulation import UNITS, Simulation
from slewctl.measured.log import Log
from slewctl.plant.signals import SIGNALS

# A part of the signal's own range: nearer than that, or than some steps of the encoder, two
# curves are one.
_APART, _STEPS = 0.02, 3.0
# So many samples in a row part two curves, one alone does not.
_FOR_GOOD = 3
# A log that holds less of the slew than this part of it is none of it.
_LEAST_OF_IT = 0.5


@dataclass(frozen=True)
class Compared:
    """One signal of the rig beside the predicted one.

    Attributes
    ----------
    name, unit : str
    measured, predicted : ndarray
        At `Replay.t`; of an angle both from where the rig was before the slew.
    fit : float
        100 (1 − ‖measured − predicted‖ / ‖measured − its mean‖): a hundred where they agree.
    apart_s : float or None
        When they first part, by more than a fiftieth of the measured range and three steps of
        the encoder; None where they never do.
    """

    name: str
    unit: str
    measured: Array
    predicted: Array
    fit: float
    apart_s: float | None

    @property
    def largest(self) -> tuple[float, float]:
        """Largest absolute value, measured and predicted."""
        return float(np.abs(self.measured).max()), float(np.abs(self.predicted).max())

    @property
    def error_rms(self) -> float:
        """Root mean square of their difference."""
        return float(np.sqrt(np.mean((self.measured - self.predicted) ** 2)))


@dataclass(frozen=True, eq=False)
class Replay(Tabular):
    """A slew of a rig beside its simulation.

    Attributes
    ----------
    log : Log
    simulation : Simulation
    start_s : float
        When the slew begins in the log.
    start_from : {"reference", "output"}
        Which of the log's signals tells: of the output alone, a dead time cannot be told from a
        later start.
    t : ndarray
        Samples of the log within the slew, from its start, in s.
    output, command : Compared
        The log's sensor, and what the drive was told.
    """

    log: Log
    simulation: Simulation
    start_s: float
    start_from: str
    t: Array
    output: Compared
    command: Compared

    @property
    def caption(self) -> str:
        """Where the slew is in the log."""
        return (
            f"a slew of {self.simulation.slew.angle_deg:g} degrees from {self.start_s:.4g} s of "
            f"{self.log.duration:.4g} s on, by the {self.start_from}"
        )

    def rows(self) -> list[dict[str, object]]:
        """Return one row a signal."""
        return [
            {
                "signal": c.name,
                "unit": c.unit,
                "fit (%)": c.fit,
                "error rms": c.error_rms,
                "parts at (s)": c.apart_s,
                "largest measured": c.largest[0],
                "largest predicted": c.largest[1],
            }
            for c in (self.output, self.command)
        ]

    def plot(self, what: str = "output", ax: Axes | None = None) -> Axes:
        """Draw the rig's signal over the predicted one.

        Parameters
        ----------
        what : {"output", "command"}
        ax : matplotlib Axes, optional
            By default those of a new figure.
        """
        shown: Compared = {"output": self.output, "command": self.command}[what]
        ax = axes_or_new(ax)
        ax.plot(self.t, shown.predicted, lw=4, alpha=0.4, label="predicted")
        ax.plot(self.t, shown.measured, lw=1, label="measured")
        ax.set_xlabel("time from the start of the slew (s)")
        ax.set_ylabel(f"{shown.name.replace('_', ' ')} ({shown.unit})")
        ax.legend()
        return ax


def replay(simulation: Simulation, log: Log) -> Replay:
    """Return a log of a slew beside its prediction.

    The start of the slew in the log is the one at which the reference, where the log has it,
    or else the output, agrees best with the simulated one, to a fraction of a sample.

    Parameters
    ----------
    simulation : Simulation
        Of the slew that the rig made, by `slewctl.simulate` or `Problem.simulate`.
    log : Log
        In closed loop; its input is what the drive was told.

    Returns
    -------
    Replay

    Raises
    ------
    InputError
        If the simulation has no such sensor or actuator, the log holds less than half of the
        slew, or has a gap in it.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> problem = sc.Problem(arm, {"tip": 0.03, "torque": 1.0}, {"torque": 0.1, "theta": 0.01},
    ...                      slew=sc.Slew(30.0, 4.0))
    >>> K = sc.lqg(problem.plant("clamped-free", n=1), sample_time=0.02)
    >>> made = problem.simulate(K)
    >>> t = 0.02 * np.arange(500)
    >>> theta = np.interp(t - 1.0, made.t, made.signals["theta"])
    >>> torque = np.interp(t - 1.0, made.t, made.signals["torque"], left=0.0)
    >>> found = sc.replay(made, sc.Log(0.02, torque, theta))
    >>> round(found.start_s, 3), found.output.fit > 99.9
    (1.0, True)
    """
    signals, sensor = simulation.signals, log.sensor
    told = {name for name in signals if not name.endswith("_ref")}
    if sensor not in told:
        raise InputError(
            f"a simulated slew has no {sensor}",
            where="log.sensor",
            remedy=f"give a log of {', '.join(sorted(told & {*SIGNALS}))}",
        )
    if log.actuator not in signals:
        raise InputError(
            f"the log has a {log.actuator}, and the simulated arm has no motor",
            where="log.actuator",
            remedy="give a log of the torque",
        )
    start, by = _start(simulation, log)
    clock = log.sample_time * np.arange(log.samples)
    # The drive holds a sample: just after one it is what it was told then.
    within = (clock >= start) & (clock <= start + simulation.t[-1])
    t = clock[within] - start
    if len(t) < 2 or t[-1] < _LEAST_OF_IT * simulation.slew.duration_s:
        raise InputError(
            f"the log holds {t[-1] if len(t) else 0.0:.3g} s of a slew of "
            f"{simulation.slew.duration_s:g} s",
            where="log",
            remedy="give the whole slew",
        )
    early = log.cut[0] and start < log.sample_time
    if early or (log.cut[1] and start + simulation.slew.duration_s > clock[-1]):
        raise _gap(log)
    before = log.output[clock < start]
    rest = float(np.median(before)) if len(before) else float(log.output[0])
    turned = sensor.startswith("theta") and not sensor.endswith("dot")
    predicted = np.interp(t, simulation.t, signals[sensor])
    measured = log.output[within] - (rest if turned else 0.0)
    given = _held(simulation, log.actuator, t, log.sample_time)
    output = _compared(sensor, measured, predicted, t, log.resolution)
    if log.cut[0] and output.fit < 0:  # it found no slew, for it begins before
        raise _gap(log)
    return Replay(
        log,
        simulation,
        start,
        by,
        t,
        output,
        _compared(log.actuator, log.input[within], given, t, 0.0),
    )


def _gap(log: Log) -> InputError:
    return InputError(
        "; ".join(["the log has a gap in the slew", *log.remarks]),
        where="log",
        remedy="give a log without gaps in the slew",
    )


def _held(simulation: Simulation, name: str, t: Array, sample_time: float) -> Array:
    """Return what was commanded over each sample: the simulated signal in its middle."""
    return np.asarray(np.interp(t + 0.5 * sample_time, simulation.t, simulation.signals[name]))


def _start(simulation: Simulation, log: Log) -> tuple[float, str]:
    """Return when the slew begins in a log, and which signal says so."""
    from scipy.optimize import minimize_scalar  # slow to load: not before it is wanted

    if log.reference is not None and np.ptp(log.reference):
        signal, model, by = log.reference, simulation.signals["theta_ref"], "reference"
    else:
        signal, model, by = log.output, simulation.signals[log.sensor], "output"
    clock = log.sample_time * np.arange(log.samples)

    def missed(start: float) -> float:
        """Return what is left of the signal by the model, its size and offset free."""
        shape = np.interp(clock - start, simulation.t, model)
        columns = np.column_stack([shape, np.ones_like(shape)])
        left = signal - columns @ np.linalg.lstsq(columns, signal, rcond=None)[0]
        return float(left @ left)

    last = clock[-1] - _LEAST_OF_IT * simulation.slew.duration_s
    shape = np.interp(clock, simulation.t, model) - model[0]
    best = clock[int(np.argmin(_missed_from(signal, shape)[clock <= max(last, 0.0)]))]
    near = (max(best - log.sample_time, 0.0), best + log.sample_time)
    found = minimize_scalar(missed, bounds=near, method="bounded", options={"xatol": 1e-6})
    return float(found.x), by


def _missed_from(signal: Array, shape: Array) -> Array:
    """Return what a shape that begins at each sample leaves of a signal, size and offset free.

    By the normal equations, of which the correlation is that of all samples at once.
    """
    n = len(signal)
    moved = signal - signal.mean()
    spectra = np.fft.rfft(moved, 2 * n) * np.fft.rfft(shape, 2 * n).conj()
    along = np.fft.irfft(spectra)[:n]
    # A shape that begins later has fewer samples left in the log.
    total, square = (np.cumsum(part)[::-1] for part in (shape, shape**2))
    size = square - total**2 / n
    told = size > np.finfo(float).eps * square
    share = np.where(told, along**2 / np.where(told, size, 1.0), 0.0)
    return np.asarray(float(moved @ moved) - share)


def _compared(name: str, measured: Array, predicted: Array, t: Array, step: float) -> Compared:
    spread = float(np.linalg.norm(measured - measured.mean()))
    off = np.abs(measured - predicted)
    fit = 100 * (1 - float(np.linalg.norm(off)) / spread) if spread else -math.inf
    far = off > max(_APART * float(np.ptp(measured)), _STEPS * step)
    run = np.convolve(far, np.ones(_FOR_GOOD), "valid") == _FOR_GOOD
    apart = float(t[int(np.argmax(run))]) if run.any() else None
    return Compared(name, UNITS[name], measured, predicted, fit, apart)
