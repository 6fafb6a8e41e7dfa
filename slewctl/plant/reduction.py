"""Reduction after modelling: balanced and modal truncation that leave the rigid body alone.

A large model, such as the truth, is cut down to few states by what its inputs and outputs
see of it.  The rigid-body poles are split off first and kept exactly; the error is that of
the flexible part alone and has a bound:

    balanced truncation    ‖G − Gr‖∞ <= 2 Σ of the Hankel singular values cut off
                           (Enns, 1984; Glover, Int. J. Control 39, 1984)
    modal truncation       ‖G − Gr‖∞ <= 2 Σ of the removed part's Hankel singular values,
                           with the static correction and without: a strictly proper G and
                           G − G(0) are both what is lost when all its states go, by
                           truncation or by singular perturbation (Liu and Anderson, Int. J.
                           Control 50, 1989).

Errors of unlike signals are weighed against each other, so the result depends on units.  A
generalised plant therefore counts its actuator in units of its limit and its sensors in
units of their noise, as D12 and D21 give them; a plain system takes ``sizes``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.linalg import block_diag

from slewctl._types import Array
from slewctl.errors import AccuracyError, InputError, check_choice, check_count
from slewctl.numerics.linear_system import LinearSystem
from slewctl.plant.balancing import balanced, damped, refuse_undamped
from slewctl.plant.problem import GeneralisedPlant
from slewctl.plant.reduced import Reduced
from slewctl.plant.separation import Part, Separated, continuous, separate
from slewctl.plant.sizes import given_sizes, own_sizes

if TYPE_CHECKING:
    import control

# What the names of a mode's states end with; numbered where poles coincide.
_ENDS = {1: [""], 2: ["_re", "_im"]}
# The attained error may pass the bound by rounding of this much of the system's size.
_ROUNDING = 1e-11


def balanced_truncation(
    system: control.StateSpace | GeneralisedPlant,
    order: int,
    *,
    path: Literal["all", "control"] = "all",
    sizes: Mapping[str, float] | None = None,
) -> Reduced:
    """Return the balanced truncation of a system, its rigid-body part kept exactly.

    Square-root method (Tombs and Postlethwaite, Int. J. Control 46, 1987) on the flexible
    part in modal coordinates, where both Gramians are known in closed form.

    Parameters
    ----------
    system : control.StateSpace or GeneralisedPlant
        Its flexible modes damped.
    order : int
        States to keep, the rigid body's (two for an arm) included.
    path : {"all", "control"}
        Of a generalised plant, balance everything, or only the path from the actuator to
        the sensors; disturbances and performance outputs then follow without a bound.
    sizes : mapping of str to float, optional
        Typical sizes of inputs and outputs by name, in which errors are counted; 1 where
        absent.  Only for a plain system: a generalised plant knows its own.

    Returns
    -------
    Reduced

    Raises
    ------
    InputError
        If a mode is undamped, the order leaves nothing to remove or cannot be had, or the
        system is unstable (see `separate`).
    AccuracyError
        If the Gramians or the bound are not confirmed, or the reduced system is unstable.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> full = sc.state_space(sc.truth(arm, 6), ["theta", "tip"])
    >>> reduced = sc.balanced_truncation(full, 4)
    >>> reduced.system.nstates, reduced.error <= reduced.bound
    (4, True)
    """
    source = _Source.of(system, path, sizes)
    whole = source.separated
    rigid, flexible = len(whole.rigid.A), len(whole.poles)
    kept = check_count(order, "order") - rigid
    if not 0 <= kept <= flexible:
        raise InputError(
            f"a system of {rigid} rigid-body and {flexible} flexible states has no reduction "
            f"to {order}",
            where="order",
            remedy=f"keep {max(rigid, 1)} to {rigid + flexible} states",
        )
    weighed = source.weighed
    refuse_undamped(weighed)
    hankel, T, inverse, residual = balanced(weighed)
    counting = int((hankel > flexible * np.finfo(float).eps * hankel.max(initial=0.0)).sum())
    if kept > counting:
        raise InputError(
            f"only {counting} flexible states are both reached and seen",
            where="order",
            remedy=f"keep at most {rigid + counting} states",
        )
    T, inverse = T[:, :kept], inverse[:kept]
    real = whole.real()
    part = Part(inverse @ real.A @ T, inverse @ real.B, real.C @ T)
    if kept and not np.linalg.eigvals(part.A).real.max() < 0:
        raise AccuracyError(
            "the reduced system is not stable: the order cuts a pair of states that count alike",
            where="balanced_truncation",
            remedy=f"keep {order + 1} or {order - 1} states",
        )
    names = tuple(f"balanced{i}" for i in range(1, kept + 1))
    return source.reduced(
        part, names, "balanced truncation", 2 * float(hankel[kept:].sum()), hankel, residual
    )


def modal_truncation(
    system: control.StateSpace | GeneralisedPlant,
    modes: int,
    static_correction: bool = True,
    *,
    sizes: Mapping[str, float] | None = None,
) -> Reduced:
    """Return the first modes of a system with the static response of the others.

    Without correction D stays what it was: the reduced system is exact at infinite
    frequency.  With it, what the removed modes contribute at rest, −C A⁻¹ B, is added to
    D: it is exact (beside the rigid body) at zero frequency.  An acceleration, whose D sums
    up all modes, so loses the contribution of the removed ones; for displacements it is
    their compliance, and D is then no longer zero.

    An H2 problem does not allow that: a feedthrough from white torque noise to a
    performance output makes the cost infinite.  A generalised plant's ``system`` and
    ``plant`` are therefore left without, and only the response from actuator to sensors,
    where the correction does no harm, is kept as `Reduced.feedthrough` for
    `Reduced.corrected`.  The bound and the error are those of the system returned.

    Parameters
    ----------
    system : control.StateSpace or GeneralisedPlant
    modes : int
        Flexible modes to keep, the slowest first, beside the rigid body.
    static_correction : bool
    sizes : mapping of str to float, optional
        As for `balanced_truncation`.

    Returns
    -------
    Reduced

    Raises
    ------
    InputError
        If the system has fewer modes, or is unstable (see `separate`).
    AccuracyError
        If the Gramians or the bound are not confirmed.

    Examples
    --------
    >>> import slewctl as sc
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> full = sc.state_space(sc.truth(arm, 6), ["theta", "tip"])
    >>> sc.modal_truncation(full, 1).system.nstates
    4
    """
    source = _Source.of(system, "all", sizes)
    whole = source.separated
    if check_count(modes, "modes", 0) > len(whole.modes):
        raise InputError(
            f"the system has {len(whole.modes)} flexible modes",
            where="modes",
            remedy=f"keep at most {len(whole.modes)}",
        )
    kept, removed = whole.chosen(slice(modes)), whole.chosen(slice(modes, None))
    hankel, residual = np.zeros(0), whole.residual
    bound = 0.0
    lost = source.weigh(removed)
    if removed.modes:
        bound = np.inf
        if damped(lost):
            hankel, _, _, residual = balanced(lost)
            bound = 2 * float(hankel.sum())
    compliance = np.real(removed.response(0.0))
    D, feedthrough, method = np.zeros_like(compliance), np.zeros((0, 0)), "modal truncation"
    if static_correction:
        method += " with static correction"
        if source.plant is None:
            D = compliance
        else:
            feedthrough = compliance[source.plant.performance :, -1:]
    names = tuple(
        f"mode{k}{end}"
        for k, mode in enumerate(kept.modes, 1)
        for end in _ENDS.get(len(mode), [f"_{i}" for i in range(1, len(mode) + 1)])
    )
    return source.reduced(kept.real(), names, method, bound, hankel, residual, D, feedthrough)


@dataclass(frozen=True, eq=False)
class _Source:
    """A system to be reduced, taken apart, with the unit in which each signal counts."""

    system: LinearSystem
    plant: GeneralisedPlant | None
    inputs: Array  # size of each input, zero for one that is left out
    outputs: Array  # one over the size of each output
    separated: Separated

    @classmethod
    def of(cls, given: object, path: str, sizes: Mapping[str, float] | None) -> _Source:
        check_choice(path, ("all", "control"), "path")
        if not isinstance(given, GeneralisedPlant):
            if path == "control":
                raise InputError(
                    "only a generalised plant has a control path",
                    where="path",
                    remedy="select the inputs and outputs of the system",
                )
            light = continuous(given)
            parts = separate(light)
            inputs, outputs = given_sizes(light, sizes or {})
            return cls(light, None, inputs, outputs, parts)
        if sizes is not None:
            raise InputError(
                "a generalised plant has the sizes of its signals in its limits and noises",
                where="sizes",
                remedy="leave it out",
            )
        inputs, outputs = own_sizes(given)
        if path == "control":
            inputs[:-1], outputs[: given.performance] = 0.0, 0.0
        return cls(given.linear, given, inputs, outputs, separate(given.linear))

    @property
    def weighed(self) -> Separated:
        """The separated system with every signal in its unit."""
        return self.weigh(self.separated)

    def weigh(self, parts: Separated) -> Separated:
        """Return the flexible modes with every signal in its unit."""
        return replace(parts, B=parts.B * self.inputs, C=parts.C * self.outputs[:, None])

    def reduced(
        self,
        part: Part,
        names: Sequence[str],
        method: str,
        bound: float,
        hankel: Array,
        residual: float,
        D: Array | None = None,
        feedthrough: Array | None = None,
    ) -> Reduced:
        """Return the result with the rigid body beside `part`, its error checked."""
        rigid, extra = self.separated.rigid, np.zeros(self.system.D.shape) if D is None else D
        error, size = self._error(part, extra)
        if error > bound + _ROUNDING * size:
            raise AccuracyError(
                f"the error {error:.3g} passes its bound {bound:.3g}",
                where=method,
                remedy="use modal coordinates",
            )
        states = (("rigid", "rigid_dot")[: len(rigid.A)], names)
        system = LinearSystem(
            block_diag(rigid.A, part.A),
            np.vstack([rigid.B, part.B]),
            np.hstack([rigid.C, part.C]),
            np.asarray(self.system.D) + extra,
            inputs=self.system.input_labels,
            outputs=self.system.output_labels,
            states=[name for group in states for name in group],
            name=f"{self.system.name}_reduced_to_{len(rigid.A) + len(part.A)}",
        )
        return Reduced(
            system,
            replace(self.plant, system=system, model=None) if self.plant else None,
            method,
            system.nstates,
            bound,
            error,
            hankel,
            self._sizes(),
            max(residual, self.separated.residual),
            np.zeros((0, 0)) if feedthrough is None else feedthrough,
        )

    def _error(self, part: Part, D: Array) -> tuple[float, float]:
        """Return the largest singular value of G − Gr found, and that of G beside it."""
        whole = self.weighed
        B, C = part.B * self.inputs, part.C * self.outputs[:, None]
        extra = D * self.inputs * self.outputs[:, None]
        error, size = float(np.linalg.norm(extra, 2)), 0.0
        own = np.linalg.eigvals(part.A) if len(part.A) else np.zeros(0, complex)
        poles = np.concatenate([whole.poles, own])
        for omega in np.unique(np.concatenate([[0.0], np.abs(poles), np.abs(poles.imag)])):
            s = 1j * omega
            if np.any(s == whole.poles):
                return np.inf, np.inf  # an undamped mode: the error has no bound either
            G = whole.response(s)
            Gr = C @ np.linalg.solve(s * np.eye(len(part.A)) - part.A, B.astype(complex))
            error = max(error, float(np.linalg.norm(G - Gr - extra, 2)))
            size = max(size, float(np.linalg.norm(G, 2)))
        return error, size

    def _sizes(self) -> dict[str, float]:
        labels = zip(self.system.input_labels, self.inputs, strict=True)
        found = {str(name): float(size) for name, size in labels if size > 0}
        ends = zip(self.system.output_labels, self.outputs, strict=True)
        return found | {str(name): float(1 / size) for name, size in ends if size > 0}
