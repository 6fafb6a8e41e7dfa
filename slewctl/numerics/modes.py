"""The modes of a real state matrix: which poles belong together, and what each contributes.

One answer each to the questions that reductions, designs and loops ask of a state matrix.
What is done with the answers differs from room to room, the answers do not:

* At the origin (`at_origin`) is what is nearer to it than 1e-7 of the size to which the poles
  are known: the norm of the balanced matrix, or a frequency where the zeros are exact.
* The rigid body (`rigid_body`) has the poles at the origin, and if that is a single one the
  slowest real pole beside it: −c/J of friction at the hub.
* A conjugate pair is one mode (`conjugate_pairs`); of real poles either the two of an
  overdamped mode or the nearest in size go together (`real_pairs`).
* Poles nearer to each other than a width, by a chain of such, are one cluster (`near`,
  `linked`).  Its eigenvectors are not to be trusted one by one, the subspace that they span
  is, from an ordered Schur form (`invariant_basis`).
* What a single pole contributes (`Eigensystem.residues`) comes from left and right
  eigenvectors of the balanced matrix, not from an inverse: the eigenvectors of poles that
  coincide elsewhere in the matrix have none.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import LinAlgError, eig

from slewctl._types import Array, BoolArray, ComplexArray, IntArray
from slewctl.errors import AccuracyError
from slewctl.numerics.balance import balance
from slewctl.numerics.ordered_schur import nearest_of, ordered_schur

# A double pole at the origin is computed with an error of up to √ε = 1.5e-8 of the matrix.
AT_ORIGIN = 1e-7
# The left and right unit vectors of a pole meet with 1/(its condition number); those of a
# double pole, which would be orthogonal, with what rounding makes of it.
_MEETING = float(np.finfo(float).eps ** 0.5)


@dataclass(frozen=True, eq=False)
class Eigensystem:
    """The poles of a real matrix A with their eigenvectors, in balanced coordinates.

    Attributes
    ----------
    poles : ndarray of complex, shape (n,)
    right : ndarray of complex, shape (n, n)
        A right eigenvector of unit length in each column.
    left : ndarray of complex, shape (n, n)
        A left one, conjugated and of unit length, in each row.
    scale : ndarray, shape (n,)
        x = scale · (balanced x).
    balanced : ndarray, shape (n, n)
        diag(1/scale) A diag(scale).
    """

    poles: ComplexArray
    right: ComplexArray
    left: ComplexArray
    scale: Array
    balanced: Array

    @classmethod
    def of(cls, A: Array) -> Eigensystem:
        """Return the eigensystem of a real matrix, shape (n, n)."""
        n = len(A)
        if not n:
            none = np.zeros((0, 0), dtype=complex)
            return cls(np.zeros(0, dtype=complex), none, none, np.ones(0), np.zeros((0, 0)))
        scale = balance(A)
        balanced = A / scale[:, None] * scale
        # Three results with left=True: the stubs of scipy promise two.
        values, left, right = eig(balanced, left=True)  # type: ignore[misc]
        poles = np.asarray(values, dtype=complex)
        return cls(poles, right.astype(complex), left.conj().T.astype(complex), scale, balanced)

    @property
    def size(self) -> float:
        """2-norm of the balanced matrix: the poles are known to ε times this at best."""
        return float(np.linalg.norm(self.balanced, 2)) if len(self.balanced) else 0.0

    @property
    def meeting(self) -> ComplexArray:
        """Product of each pole's left and right unit vector, shape (n,).

        One over its size is the pole's condition number; it is kept from zero.
        """
        product = np.sum(self.left.T * self.right, axis=0)
        return np.where(np.abs(product) < _MEETING, _MEETING, product)

    @property
    def columns(self) -> ComplexArray:
        """Right eigenvectors in the coordinates of A, in columns."""
        return self.scale[:, None] * self.right

    @property
    def rows(self) -> ComplexArray:
        """Left eigenvectors in the coordinates of A, in rows, with rows @ columns = 1."""
        return self.left / self.meeting[:, None] / self.scale

    def residues(self, B: Array, C: Array, which: IntArray) -> ComplexArray:
        """Return what some poles contribute to C(s − A)⁻¹B: the factors of 1/(s − λ).

        Parameters
        ----------
        B, C : ndarray, shapes (n, m), (p, n)
        which : ndarray of int, shape (k,)
            Single poles.

        Returns
        -------
        ndarray of complex, shape (k, p, m)
        """
        reached, seen = self.rows[which] @ B, C @ self.columns[:, which]
        return np.asarray(seen.T[:, :, None] * reached[:, None, :])


def eigensystem(A: Array) -> Eigensystem:
    """Return the eigensystem of a real matrix; of the one last asked about, the same again.

    Stability and the cost of a loop are told from the same one.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    """
    A = np.ascontiguousarray(A, dtype=float)
    return _eigensystem(A.tobytes(), len(A))


@lru_cache(maxsize=1)
def _eigensystem(entries: bytes, n: int) -> Eigensystem:
    return Eigensystem.of(np.frombuffer(entries).reshape(n, n))


def at_origin(poles: ComplexArray, size: float) -> BoolArray:
    """Return which poles are at the origin.

    Parameters
    ----------
    poles : ndarray of complex, shape (n,)
    size : float
        To which the poles are known: `Eigensystem.size` for a matrix in any coordinates, the
        first flexible frequency where the zeros stand in the matrix, in the poles' unit.
    """
    return np.asarray(np.abs(poles) <= AT_ORIGIN * size)


def rigid_body(poles: ComplexArray, size: float) -> BoolArray:
    """Return which poles are a rigid body's: those at the origin, or one and the next real one.

    Parameters
    ----------
    poles, size
        As for `at_origin`.

    Examples
    --------
    >>> import numpy as np
    >>> rigid_body(np.array([-0.5, 0, -1 + 9j, -1 - 9j, -40]), 40.0).tolist()
    [True, True, False, False, False]
    """
    rigid = at_origin(poles, size)
    if rigid.sum() == 1:
        rest = np.where(rigid | (poles.imag != 0), np.inf, np.abs(poles))
        if np.isfinite(rest.min()):
            rigid = rigid.copy()
            rigid[int(np.argmin(rest))] = True
    return rigid


def conjugate_pairs(poles: ComplexArray, kept: Iterable[int]) -> list[tuple[int, int]]:
    """Return the pairs of complex poles, the upper one first.

    Parameters
    ----------
    poles : ndarray of complex
        Of a real matrix, as LAPACK orders them: a pole and its conjugate follow each other.
    kept : iterable of int
        Indices; both of a pair are among them.
    """
    return [(i, i + 1) for i in kept if poles[i].imag > 0]


def real_pairs(
    poles: ComplexArray, kept: Iterable[int], *, overdamped: bool
) -> tuple[list[tuple[int, int]], list[int]]:
    """Return the real poles two by two, the faster first, and the one of an odd number left over.

    Parameters
    ----------
    poles : ndarray of complex
    kept : iterable of int
    overdamped : bool
        Whether they are those of overdamped modes.  These pair from the middle outwards, and
        the slowest is left over: Kelvin–Voigt damping sends one of each pair to −1/η, the other
        far left.  Otherwise each goes with its neighbour, so that a pair is moved by little, and
        the fastest is left over, as that of a lag.

    Examples
    --------
    >>> import numpy as np
    >>> poles = np.array([-1.0, -2, -3, -4, -5])
    >>> real_pairs(poles, range(5), overdamped=True)
    ([(3, 2), (4, 1)], [0])
    >>> real_pairs(poles, range(5), overdamped=False)
    ([(1, 0), (3, 2)], [4])
    """
    real = sorted((i for i in kept if poles[i].imag == 0), key=lambda i: -abs(poles[i]))
    half, odd = divmod(len(real), 2)
    if overdamped:
        left = real[2 * half :]
        return [(real[half - 1 - i], real[half + i]) for i in range(half)], left
    slow = real[odd:][::-1]
    return [(slow[2 * k + 1], slow[2 * k]) for k in range(half)], real[:odd]


def near(poles: ComplexArray, width: float, floor: float = 0.0) -> BoolArray:
    """Return which poles are near to each other, shape (n, n).

    Parameters
    ----------
    poles : ndarray of complex, shape (n,)
    width : float
        Largest distance over the size of the larger of two.
    floor : float
        What is added to it, in the poles' unit.
    """
    sizes = np.abs(poles)
    room = width * np.maximum(sizes[:, None], sizes) + floor
    return np.asarray(np.abs(poles[:, None] - poles) <= room)


def linked(joined: BoolArray) -> list[IntArray]:
    """Return the groups that a chain of joined ones links, each increasing.

    Parameters
    ----------
    joined : ndarray of bool, shape (n, n)

    Examples
    --------
    >>> import numpy as np
    >>> [group.tolist() for group in linked(near(np.array([1, 5, 1.1, 1.2]), 0.1))]
    [[0, 2, 3], [1]]
    """
    n = len(joined)
    labels, joined = np.arange(n), joined | joined.T | np.eye(n, dtype=bool)
    while True:  # the smallest index within reach, and what that one has reached
        least = np.where(joined, labels, n).min(axis=1, initial=n)
        least = least[least]
        if np.array_equal(least, labels):
            return [np.flatnonzero(labels == k) for k in np.unique(labels)]
        labels = least


def invariant_basis(
    A: Array, poles: ComplexArray, chosen: Sequence[int] | IntArray, where: str
) -> Array:
    """Return an orthonormal basis of the invariant subspace of some eigenvalues, shape (n, k).

    Parameters
    ----------
    A : ndarray, shape (n, n)
    poles : ndarray of complex, shape (n,)
        All its eigenvalues, as another computation found them.
    chosen : sequence of int
        Indices; both of a pair, or none.
    where : str
        For messages: the computation that wants it.

    Raises
    ------
    AccuracyError
        If rounding mixes them with others.
    """
    try:
        _, Z, count = ordered_schur(A, nearest_of(poles, chosen))
    except LinAlgError as error:
        raise inseparable(where) from error
    if count != len(chosen):
        raise inseparable(where)
    return Z[:, :count]


def inseparable(where: str) -> AccuracyError:
    """Return the error of poles that rounding mixes with others."""
    return AccuracyError(
        "the modes of the system cannot be told apart to working precision",
        where=where,
        remedy="give it in modal coordinates",
    )
