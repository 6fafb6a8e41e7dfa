"""What a fit to a response or a log found, and how well the measurement determines it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from slewctl._show import Axes, Described, axes_or_new
from slewctl._types import Array, ComplexArray
from slewctl.arm import Arm
from slewctl.arm.parts import arm_table
from slewctl.errors import InputError, check_choice
from slewctl.export import toml_text
from slewctl.measured.ellipsoid import ellipsoid_ends
from slewctl.measured.fit_result import Estimate, correlated
from slewctl.measured.log import Log
from slewctl.measured.response import Response
from slewctl.measured.response_data import channel_of, rig_response
from slewctl.measured.rig_model import Modes
from slewctl.measured.rig_parameters import DELAY, Rig
from slewctl.measured.roots import Root

# Keys of `slewctl.arm.vary` for what a fit adjusts; of the factors, times what was found.
_KEYS = {
    "beam.stiffness": "stiffness_factor",
    "beam.mass": "mass_factor",
    "damping": "damping_factor",
    "payload.mass": "payload_mass",
    "payload.inertia": "payload_inertia",
    "hub.inertia": "hub_inertia",
    "hub.radius": "hub_radius",
    "hub.friction": "hub_friction",
    "joint.stiffness": "joint_stiffness",
    DELAY: "actuator_delay",
}


@dataclass(frozen=True, eq=False, repr=False)
class RigFit(Described):
    """An arm adjusted to a measured response or to a log.

    Attributes
    ----------
    arm : Arm
        The adjusted arm; its actuator has the dead time that was found, less the sensor's own.
    gain : float
        What the actuator gives of what it is told.
    delay : float
        Whole dead time in s, from the command to the reading.
    response : Response
        The measured one; of a log, estimated from it.
    modes : int
        Of the model.
    estimates : tuple of Estimate, length n
        The adjusted properties, in the order asked for.
    of_arm, logarithmic : tuple of bool, length n
        Whether a property is the arm's, its drive's dead time included; whether its logarithm
        is taken as normal.
    covariance : ndarray, shape (n, n)
        Of the properties in their units, linearised; NaN where one is not determined.
    undetermined : tuple of tuple of str
        Groups of properties that the measurement does not tell apart.
    scatter : float
        How many times the stated deviations, or those of the noise model, the residuals are;
        the intervals are widened by it.  Of a response without deviations it is the relative
        deviation itself.
    degrees_of_freedom : int
    roots : tuple of Root
        Poles and zeros that the response shows by its coherence, beside the measured ones.
    log : Log or None
        What was fitted, if it was a log.
    explained : float
        How much of a log's output the input makes through the rig: one less the size of what
        is left, over that of the output, both without what the state at the beginning and dry
        friction make; NaN of a response.
    remarks : tuple of str
    """

    arm: Arm
    gain: float
    delay: float
    response: Response
    modes: int
    estimates: tuple[Estimate, ...]
    of_arm: tuple[bool, ...]
    logarithmic: tuple[bool, ...]
    covariance: Array
    undetermined: tuple[tuple[str, ...], ...]
    scatter: float
    degrees_of_freedom: int
    roots: tuple[Root, ...]
    log: Log | None
    explained: float
    remarks: tuple[str, ...]

    def __post_init__(self) -> None:
        self.covariance.setflags(write=False)

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of the property called `name`."""
        named = {estimate.name: estimate for estimate in self.estimates}
        return named[check_choice(name, named, "fit")]

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of a property in its unit.

        Parameters
        ----------
        name : str
        level : float
            Probability.
        """
        found = self[name]
        reach = float(ndtri(0.5 + level / 2)) * found.standard_deviation
        position = [estimate.name for estimate in self.estimates].index(name)
        if self.logarithmic[position]:
            factor = float(np.exp(min(reach / found.value, 700.0)))
            return found.value / factor, found.value * factor
        return max(found.value - reach, 0.0), found.value + reach

    @property
    def correlation(self) -> Array:
        """Correlations of the properties, shape (n, n)."""
        spread = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.covariance / np.outer(spread, spread)

    def computed(self, frequencies_hz: Array | None = None) -> ComplexArray:
        """Return the response of the fitted rig, by default at the measured frequencies.

        Parameters
        ----------
        frequencies_hz : ndarray, optional
        """
        omega = self.response.omega if frequencies_hz is None else 2 * np.pi * frequencies_hz
        rig = Rig(self.arm, self.gain, self.delay)
        return rig_response(rig, channel_of(self.response), Modes(self.modes), np.asarray(omega))

    def variations(self, level: float = 0.95) -> dict[str, dict[str, Any]]:
        """Return the arm's uncertainty as ``[variations]`` of a design file.

        They are the ends of the principal axes of the confidence ellipsoid of the arm's
        properties and of the dead time, two a property, widest axis first.  The gain, which
        belongs to no arm, is left out; what the measurement does not determine cannot be varied.

        Parameters
        ----------
        level : float
            Probability of the ellipsoid.

        Returns
        -------
        dict of str to dict
            Keywords of `slewctl.arm.vary` for the fitted arm, by name.
        """
        chosen = [j for j, of_arm in enumerate(self.of_arm) if of_arm]
        covariance = self.covariance[np.ix_(chosen, chosen)]
        lost = [self.estimates[j].name for j in chosen if not np.isfinite(self.covariance[j, j])]
        if lost or not chosen:
            raise InputError(
                f"{', '.join(lost) or 'nothing of the arm'} is not determined by the measurement",
                where="variations",
                remedy="fix what cannot be told apart, and fit again",
            )
        values = np.array([self.estimates[j].value for j in chosen])
        logarithmic = np.array([self.logarithmic[j] for j in chosen])
        ends = ellipsoid_ends(values, covariance, logarithmic, level)
        names = [self.estimates[j].name for j in chosen]
        found = {}
        for k, end in enumerate(ends):
            side = "plus" if k % 2 else "minus"
            found[f"fit-{k // 2 + 1}-{side}"] = self._variation(names, values, end)
        return found

    def _variation(self, names: list[str], values: Array, end: Array) -> dict[str, Any]:
        told: dict[str, Any] = {}
        last = max((int(n[8:]) for n in names if n.startswith("damping.")), default=0)
        ratios = self.arm.damping_ratios(last + 1).tolist() if last else []
        for name, value, moved in zip(names, values.tolist(), end.tolist(), strict=True):
            if name.startswith("damping."):
                ratios[int(name[8:]) - 1] = min(moved, 0.999)
            else:
                key = _KEYS[name]
                told[key] = moved / value if key.endswith("_factor") else moved
        if DELAY in names:
            # The sensor keeps its part of the whole.
            own = self.arm.sensor(self.response.sensor).delay
            told[_KEYS[DELAY]] = max(told[_KEYS[DELAY]] - own, 0.0)
        if ratios:
            told["damping_ratio"] = ratios
        return told

    def to_toml(self, **tables: Mapping[str, Any]) -> str:
        """Return the adjusted arm as a file, or with further tables as a design file.

        Parameters
        ----------
        **tables
            Of the design file, such as ``model={"basis": "arm-matched", "n": 2}``,
            ``controller={"method": "lqg", …}``, ``requirements={…}`` and
            ``variations=found.variations()``.
        """
        return toml_text({"arm": arm_table(self.arm), **tables})

    def __str__(self) -> str:
        of = f"a log of {self.log.duration:.4g} s" if self.log else "a response"
        lines = [
            f"fit of {self.arm.name} to {of} from {self.response.actuator} to "
            f"{self.response.sensor}, {len(self.response.values)} points to "
            f"{self.response.frequencies_hz[-1]:.4g} Hz"
        ]
        if self.log:
            lines.append(f"  through it the input makes {self.explained:.1%} of the output")
        lines += [f"  {self._told(estimate)}" for estimate in self.estimates]
        for group in self.undetermined:
            what = "has no effect on this measurement" if len(group) == 1 else (
                "cannot be told apart: fix one of them")  # fmt: skip
            lines.append(f"  {', '.join(group)} {what}")
        lines += [f"  {text}" for text in correlated(self.estimates, self.correlation)]
        lines += [f"  {remark}" for remark in self.remarks]
        lines += [
            f"  {root.kind} {root.frequency_hz:.5g} ± {1.96 * root.frequency_deviation_hz:.2g} Hz, "
            f"ratio {root.damping_ratio:.3g} ± {1.96 * root.damping_deviation:.2g}"
            for root in self.roots
        ]
        return "\n".join(lines)

    def _told(self, estimate: Estimate) -> str:
        if not np.isfinite(estimate.standard_deviation):
            return str(estimate)
        low, high = self.interval(estimate.name)
        limit = " (at its limit)" if estimate.at_limit else ""
        return (
            f"{estimate.name} = {estimate.value:.5g} {estimate.unit}, {low:.5g} to {high:.5g} "
            f"with 95 %{limit}, from {estimate.start:.5g}"
        )

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the fitted response over the measured one, with its coherence.

        Parameters
        ----------
        axes : array of three matplotlib Axes, optional
            By default those of a new figure.
        """
        drawn: Any = self.response.plot(axes_or_new(axes, rows=3))
        computed = self.computed()
        drawn[0].loglog(self.response.frequencies_hz, np.abs(computed), "--")
        drawn[1].semilogx(self.response.frequencies_hz, np.angle(computed, deg=True), "--")
        return drawn
