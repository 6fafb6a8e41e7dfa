"""Which properties a measurement cannot tell apart, from the null space of its derivatives."""

from __future__ import annotations

import numpy as np

from slewctl._types import Array

_PART = 1e-6  # least squared part in the null space for which a property is named
_TOGETHER = 0.05  # least coupling, as a cosine, for which two are named together


def coupled_groups(projector: Array) -> list[list[int]]:
    """Return the properties that the null space couples, group by group.

    The projector does not depend on how the null space is spanned; two properties belong
    together when it couples them.
    """
    part = np.diag(projector)
    coupled = np.abs(projector) > _TOGETHER * np.sqrt(np.outer(part, part))
    left = [j for j in range(len(projector)) if part[j] > _PART]
    groups = []
    while left:
        group, grown = [left[0]], True
        while grown:
            more = [j for j in left if j not in group and coupled[j, group].any()]
            group, grown = group + more, bool(more)
        groups.append(sorted(group))
        left = [j for j in left if j not in group]
    return groups
