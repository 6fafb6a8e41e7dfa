"""The truth: a model of the arm whose first frequencies are converged, and which says how far."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from slewctl._types import Array
from slewctl.arm import Arm
from slewctl.basis import Basis, Combined
from slewctl.errors import check_count
from slewctl.model.assembly import (
    Factors,
    Model,
    assemble,
    check_arm,
    factors,
    model_from_factors,
)
from slewctl.model.converge import converged

DEFAULT_MODES = 20


@dataclass(frozen=True, eq=False)
class Truth(Model):
    """A model in the arm's own slewing modes, converged.

    It is a `Model` whose basis functions are the arm's own modes in the body axis, cut off
    after `modes` of them.

    Attributes
    ----------
    frequency_errors : ndarray, shape (modes,)
        Estimated relative error of each frequency: its change when the polynomial basis
        was last enlarged (the Ritz frequencies fall towards the exact ones), plus rounding.
    functions : int
        How many polynomial functions the modes were computed with.
    """

    frequency_errors: Array
    functions: int

    @property
    def modes(self) -> int:
        """Number of flexible modes kept."""
        return self.n

    @property
    def tolerance(self) -> float:
        """Largest estimated relative error of the frequencies kept."""
        return float(self.frequency_errors.max())

    def __str__(self) -> str:
        return (
            f"truth of {self.arm.name}: {self.modes} modes to {self.frequencies_hz[-1]:.4g} Hz, "
            f"frequencies converged to {self.tolerance:.0e} relative "
            f"({self.functions} polynomial functions)"
        )


def truth(arm: Arm, modes: int = DEFAULT_MODES) -> Truth:
    """Return the converged model of `arm` with its first `modes` flexible modes.

    The polynomial basis, with panels at the profiles' breakpoints, is enlarged until the
    frequencies of all kept modes stop falling.

    Parameters
    ----------
    arm : Arm
    modes : int
        How many flexible modes to keep.

    Returns
    -------
    Truth
        `Truth.tolerance` says how far the frequencies are converged.

    Raises
    ------
    InputError
        If modes < 1, or `arm` is not an arm.
    """
    check_arm(arm, "truth")
    return _truth(arm, check_count(modes, "truth.modes"))


def arm_modes(arm: Arm, n: int) -> Basis:
    """Return the arm's own first `n` slewing modes as a basis: the yardstick for all others.

    Each is a converged mode of the free arm minus its root slope times x.

    Parameters
    ----------
    arm : Arm
    n : int

    Raises
    ------
    InputError
        As `truth`.
    """
    return truth(arm, n).basis


@lru_cache(maxsize=64)
def _truth(arm: Arm, modes: int) -> Truth:
    fine, errors, _ = converged(
        arm, modes, lambda basis: assemble(arm, basis), lambda model: model.omega
    )
    return _cut(fine, modes, errors + fine.quadrature_error)


def _cut(model: Model, modes: int, errors: Array) -> Truth:
    """Return `model` in the coordinates of its own first `modes` flexible modes."""
    chosen = model.mode_shapes[1:, 1 : modes + 1]
    basis = Combined(modes, model.basis, chosen)
    parts = factors(model.arm, model.basis)
    spread = np.zeros((model.n + 1, modes + 1))
    spread[0, 0] = 1.0
    spread[1:, 1:] = chosen
    cut = model_from_factors(
        model.arm,
        basis,
        Factors(parts.mass @ spread, parts.stiffness @ chosen, parts.quadrature_error),
    )
    return Truth(
        **{name: getattr(cut, name) for name in Model.__dataclass_fields__},
        frequency_errors=errors,
        functions=model.n,
    )
