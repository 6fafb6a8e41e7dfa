"""The truth: a model of the arm whose first frequencies are converged, and which says how far."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

from slewctl._threads import single_threaded
from slewctl._types import Array
from slewctl.arm import Arm, ModalData
from slewctl.basis import Basis, Combined
from slewctl.model.assembly import Model, assemble, check_arm, factors, tip_signs
from slewctl.model.converge import SMALL, check_modes, converged
from slewctl.model.damping import locked_damping

# Twice and more what a design model has; a verdict is repeated on twice as many.
DEFAULT_MODES = 20


@dataclass(frozen=True, eq=False, repr=False)
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
    def given(self) -> bool:
        """Whether the arm is from modal data: then they are the truth, and nothing converges."""
        return isinstance(self.arm.beam, ModalData)

    @property
    def complete(self) -> bool:
        """Whether it has all modes that the arm's data give, so that no finer one is to be had."""
        return self.given and self.modes == self.functions

    @property
    def modes(self) -> int:
        """Number of flexible modes kept."""
        return self.n

    @property
    def tolerance(self) -> float:
        """Largest estimated relative error of the frequencies kept."""
        return float(self.frequency_errors.max())

    def __str__(self) -> str:
        if self.given:
            of = "" if self.modes == self.functions else f"first of {self.functions}, "
            return (
                f"truth of {self.arm.name}: its {self.modes} modes as given, {of}to "
                f"{self.frequencies_hz[-1]:.4g} Hz"
            )
        return (
            f"truth of {self.arm.name}: {self.modes} modes to {self.frequencies_hz[-1]:.4g} Hz, "
            f"frequencies converged to {self.tolerance:.0e} relative "
            f"({self.functions} polynomial functions)"
            + (f"; {self.arm.damping_told}" if self.arm.damping_modes == "hub-locked" else "")
        )


@single_threaded
def truth(arm: Arm, modes: int = DEFAULT_MODES) -> Truth:
    """Return the converged model of `arm` with its first `modes` flexible modes.

    The polynomial basis, with panels at the profiles' breakpoints, is enlarged until the
    frequencies of all kept modes stop falling.

    Parameters
    ----------
    arm : Arm
    modes : int
        How many flexible modes to keep; of an arm from modal data at most those given, and that of
        an elastic joint.

    Returns
    -------
    Truth
        `Truth.tolerance` says how far the frequencies are converged.

    Raises
    ------
    InputError
        If modes < 1 or more than 500, or `arm` is not an arm.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> sc.truth(arm, 3).frequencies_hz.round(3).tolist()
    [1.061, 4.161, 10.724]
    """
    check_arm(arm, "truth")
    count = check_modes(modes, "truth.modes")
    return _truth(arm, min(count, arm.given_modes or count))


def arm_modes(arm: Arm, n: int) -> Basis:
    """Return the arm's own first `n` slewing modes as a basis: the yardstick for all others.

    Each is a converged mode of the free arm minus its root slope times x.

    Parameters
    ----------
    arm : Arm
    n : int

    Returns
    -------
    Basis

    Raises
    ------
    InputError
        As `truth`.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> modes = sc.assemble(arm, sc.arm_modes(arm, 2))
    >>> (modes.frequencies_hz / sc.truth(arm, 2).frequencies_hz).round(6).tolist()
    [1.0, 1.0]
    """
    return truth(arm, n).basis


@lru_cache(maxsize=64)
def _truth(arm: Arm, modes: int) -> Truth:
    found = converged(arm, modes, "free")
    shapes = found.shapes * tip_signs(found.basis, found.shapes)
    model = assemble(arm, Combined(modes, found.basis, shapes))
    if arm.damping_modes == "hub-locked" and found.basis.n <= SMALL:
        model = _damped_by_all(model, found.basis, shapes)
    return Truth(
        **{name: getattr(model, name) for name in Model.__dataclass_fields__},
        frequency_errors=found.errors + model.quadrature_error,
        functions=found.basis.n,
    )


def _damped_by_all(model: Model, basis: Basis, shapes: Array) -> Model:
    """Return a truth with the damping of all hub-locked modes that its polynomials have.

    Those of the few free modes that are kept would do only as well as these free modes bend at
    the clamp: without hub inertia not at all, so that the damping would converge like 1/n.
    """
    own = _locked(model.arm, model.basis)
    damping = model.damping.copy()
    damping[1:, 1:] += shapes.T @ _locked(model.arm, basis) @ shapes
    damping[1:, 1:] -= own
    return replace(model, damping=damping)


def _locked(arm: Arm, basis: Basis) -> Array:
    return locked_damping(arm, factors(arm, basis), basis.twist)
