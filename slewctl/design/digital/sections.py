"""A system in modal sections: one real pole or one pair of poles each, side by side.

A pair σ ± jω is the block [[σ, ω], [−ω, σ]].  Of all blocks with these poles its own are the
least sensitive to rounded coefficients, and rounding excites no growth in it (Barnes and Fam,
IEEE Trans. Circuits and Systems 24, 1977).  Poles whose eigenvectors are nearly parallel, as
those of a double pole, stay together in a triangular block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, block_diag, schur

from slewctl._types import Array, ComplexArray
from slewctl.design.coordinates import scaled
from slewctl.errors import AccuracyError
from slewctl.numerics.linear_system import LinearSystem
from slewctl.numerics.modes import Eigensystem, invariant_basis, linked, near

# How near poles are kept together, relative: wider only where eigenvectors are nearly parallel.
_NEARNESS = (1e-9, 1e-3, 1e-2, 0.1, 0.5)
# A change of coordinates of a worse condition costs a quarter of the digits.
_WORST = 1e4


@dataclass(frozen=True, eq=False)
class Sections:
    """A system in sections, and the way to it.

    Attributes
    ----------
    system : LinearSystem
    basis : ndarray, shape (n, n)
        Old states = basis @ states of the sections.
    sizes : tuple of int
        Number of states of each section, in their order.
    """

    system: LinearSystem
    basis: Array
    sizes: tuple[int, ...]

    def of_state(self, vectors: Array) -> Array:
        """Return vectors of the old states, in columns, in those of the sections."""
        if not vectors.size:
            return vectors
        return np.asarray(np.linalg.solve(self.basis, vectors), dtype=float)


def in_sections(system: LinearSystem) -> Sections:
    """Return a system in modal sections.

    Parameters
    ----------
    system : LinearSystem
        Continuous or sampled, with one output.

    Examples
    --------
    >>> import numpy as np
    >>> from slewctl.design.digital.sections import in_sections
    >>> from slewctl.numerics.linear_system import LinearSystem
    >>> A = np.array([[0.0, 1.0, 0.0], [-1.0, -0.2, 1.0], [0.0, 0.0, -3.0]])
    >>> found = in_sections(LinearSystem(A, np.eye(3)[:, 2:], np.eye(3)[:1], 0.0))
    >>> sorted(found.sizes)
    [1, 2]
    """
    A = system.A
    for groups in _ways(A):
        try:
            basis, blocks = _assembled(A, groups)
        except (LinAlgError, AccuracyError):
            continue
        if np.linalg.cond(basis) <= _WORST:
            break
    else:
        block, basis = schur(A, output="real")
        blocks = [np.asarray(block)]
    return _scaled(system, basis, blocks)


def _ways(A: Array) -> list[list[ComplexArray]]:
    """Return the groups of eigenvalues that may go together, the finest first."""
    poles = Eigensystem.of(A).poles
    ways = []
    for nearness in _NEARNESS if len(A) else ():
        close = near(poles, nearness)
        pairs = np.abs(poles[:, None] - poles.conj()) <= nearness * np.abs(poles)
        ways.append([poles[group] for group in linked(close | pairs | pairs.T)])
    return ways


def _assembled(A: Array, groups: list[ComplexArray]) -> tuple[Array, list[Array]]:
    poles = Eigensystem.of(A).poles
    bases, blocks = [], []
    for group in groups:
        chosen = [int(np.argmin(np.abs(poles - value))) for value in group]
        if len(set(chosen)) != len(group):
            chosen = [k for k in range(len(poles)) if poles[k] in group]
        Z = invariant_basis(A, poles, chosen, "sections")
        block, turned = schur(Z.T @ A @ Z, output="real")
        Z = Z @ turned
        if len(group) == 2 and block[1, 0]:
            Z = _normal(Z, block)
            block = np.asarray(np.linalg.lstsq(Z, A @ Z, rcond=None)[0], dtype=float)
            real = (block[0, 0] + block[1, 1]) / 2
            imaginary = (block[0, 1] - block[1, 0]) / 2
            block = np.array([[real, imaginary], [-imaginary, real]])
        bases.append(Z)
        blocks.append(np.asarray(block, dtype=float))
    return np.hstack(bases), blocks


def _normal(Z: Array, block: Array) -> Array:
    """Return the basis in which a pair of poles turns without being stretched."""
    values, vectors = np.linalg.eig(block)
    v: ComplexArray = vectors[:, int(np.argmax(values.imag))]
    v = v * np.exp(-0.5j * np.angle(v @ v))  # real and imaginary part at right angles
    return np.asarray(Z @ np.column_stack([v.real, v.imag]))


def _scaled(system: LinearSystem, basis: Array, blocks: list[Array]) -> Sections:
    """Return the sections with what enters and what leaves each of like size, by powers of two."""
    sizes = tuple(len(block) for block in blocks)
    B = np.asarray(np.linalg.solve(basis, system.B) if len(basis) else system.B, dtype=float)
    C = system.C @ basis
    scale = np.ones(len(basis))
    start = 0
    for size in sizes:
        own = slice(start, start + size)
        entering, leaving = np.linalg.norm(B[own]), np.linalg.norm(C[:, own])
        if entering and leaving:
            scale[own] = 2.0 ** np.round(np.log2(entering / leaving) / 2)
        start += size
    rest = 1.0 if system.sample_time else 0.0
    rounding = 64 * np.finfo(float).eps * max(float(np.linalg.norm(system.A)), rest)
    for block in blocks:  # an integrator is one to the last digit
        if len(block) == 1 and abs(block[0, 0] - rest) <= rounding:
            block[0, 0] = rest
    diagonal = block_diag(*blocks) if blocks else np.zeros((0, 0))
    made = LinearSystem(
        diagonal, B, C, system.D, system.dt,
        inputs=system.input_labels, outputs=system.output_labels,
        states=[f"section_{k + 1}_{i + 1}" for k, size in enumerate(sizes) for i in range(size)],
        name=system.name,
    )  # fmt: skip
    return Sections(scaled(made, scale), basis * scale, sizes)
