"""How many points a study has."""

from __future__ import annotations

import itertools
from collections import Counter

from slewctl.compare.study.grid import Grid, Study


def count_points(study: Study) -> int:
    """Return how many points a study has, without going through them.

    An axis is counted by the grids that hold a value: a point is one of the study if some
    grid holds its values of all axes.

    Parameters
    ----------
    study : Study

    Returns
    -------
    int

    Examples
    --------
    >>> import slewctl as sc
    >>> from slewctl.compare import Grid, Study, count_points
    >>> arm = sc.Arm(sc.arms.paper_beam().beam, sc.Hub(0.2), damping_ratio=0.01)
    >>> grid = Grid(bases=("slewing",), orders=(1,), hub_ratios=(1.0,), payload_ratios=(0.0,),
    ...     damping_ratios=(0.01,), bandwidths=(0.5,))
    >>> study = Study("hubs", "", arm, (grid,), truth_modes=10)
    >>> count_points(study)
    1
    """
    everywhere = frozenset(range(len(study.grids)))
    held_by = Counter({everywhere: 1})  # combinations of the axes so far, by their grids
    for axis in Grid.__dataclass_fields__:
        holders: dict[object, set[int]] = {}
        for place, grid in enumerate(study.grids):
            for value in getattr(grid, axis):
                holders.setdefault(value, set()).add(place)
        values = Counter(map(frozenset, holders.values()))
        longer: Counter[frozenset[int]] = Counter()
        for (before, many), (here, times) in itertools.product(held_by.items(), values.items()):
            longer[before & here] += many * times
        del longer[frozenset()]
        held_by = longer
    return held_by.total()
