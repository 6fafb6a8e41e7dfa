"""How well a number tells designs that go wrong from those that do not."""

from __future__ import annotations

from slewctl._types import Array, BoolArray


def area_under_curve(values: Array, bad: BoolArray) -> float:
    """Return the area under the curve of hits over false alarms (Mann and Whitney).

    Parameters
    ----------
    values : ndarray, shape (n,)
        Large where trouble is expected.
    bad : ndarray of bool, shape (n,)
        Where there was trouble; some true and some false.
    """
    from scipy.stats import rankdata  # slow to load: not before it is wanted

    ranks, ill, well = rankdata(values), int(bad.sum()), int((~bad).sum())
    return float((ranks[bad].sum() - ill * (ill + 1) / 2) / (ill * well))
