"""What the conditioning finding shows, put into words by its own figures."""

from __future__ import annotations

from slewctl.design.lmi.h2_problem import GAP
from slewctl.paper.conditioning import ConditioningFinding, Reach

_BASES = {"clamped-free": "clamped-free", "slewing": "new"}
_FORMS = {"covariance": "covariance", "riccati": "Riccati"}


def conditioning_words(finding: ConditioningFinding) -> tuple[str, ...]:
    """Return a sentence for each hub inertia, one on the solver's word, one on the cure.

    Parameters
    ----------
    finding : ConditioningFinding

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> from slewctl.paper import conditioning_words, reproduce
    >>> conditioning_words(reproduce().conditioning)  # doctest: +SKIP
    """
    ratios = dict.fromkeys(reach.hub_ratio for reach in finding.reaches)
    return (
        *(_at_hub(finding, ratio) for ratio in ratios),
        _on_the_status(finding),
        _on_the_cure(finding),
    )


def _at_hub(finding: ConditioningFinding, ratio: float) -> str:
    here = "Without a hub" if ratio == 0 else f"With a hub of {ratio:g} J_beam"
    found = [reach for reach in finding.reaches if reach.hub_ratio == ratio]
    n = finding.most_functions
    stiffness = " and ".join(
        f"{_power(finding.of(ratio, basis)[-1].raw_condition)} with the {name} functions"
        for basis, name in _BASES.items()
    )
    reached = "; ".join(
        f"the {name} form {_reached([r for r in found if r.form == form], n)}"
        for form, name in _FORMS.items()
    )
    return (
        f"{here} the state matrix of n = {n} has a condition number of {stiffness}. "
        f"Solved in raw coordinates, {reached}. {_verdict(found, n)}"
    )


def _reached(reaches: list[Reach], most: int) -> str:
    """Return how far one form gets with each basis."""
    parts = [
        f"{'to all n' if r.raw == most else f'to n = {r.raw}' if r.raw else 'at no n'} with the "
        f"{_BASES[r.basis]} functions"
        for r in reaches
    ]
    return "gets " + " and ".join(parts)


def _verdict(reaches: list[Reach], most: int) -> str:
    """Return which basis the solver prefers."""
    by_form: dict[str, dict[str, int]] = {}
    for reach in reaches:
        by_form.setdefault(reach.form, {})[reach.basis] = reach.raw
    leads = [steps["slewing"] - steps["clamped-free"] for steps in by_form.values()]
    if all(reach.raw == most for reach in reaches):
        return "Here stiff matrices do not hurt the solver."
    if all(lead == 0 for lead in leads):
        return "Neither basis gets farther than the other: here it is not the basis that decides."
    if all(lead >= 0 for lead in leads):
        return "The new functions get farther: here the paper's argument holds for a solver too."
    if all(lead <= 0 for lead in leads):
        return "The clamped-free functions get farther: here the paper's argument does not hold."
    return "Which basis gets farther depends on the form of the inequality."


def _on_the_status(finding: ConditioningFinding) -> str:
    total = len(finding.reaches) * finding.most_functions
    return (
        f"Of the {total} raw results {finding.without_point} ended without a stabilising gain, "
        f"{finding.misleading} were called optimal and are not, and {finding.modest} were "
        f"called inaccurate or failed and are optimal all the same: a solver's word is not enough."
    )


def _on_the_cure(finding: ConditioningFinding) -> str:
    scaled = [a for p in finding.points for a in (p.covariance_scaled, p.riccati_scaled)]
    optimal, gaps = sum(a.optimal for a in scaled), [a.gap for a in scaled if a.gap is not None]
    said = (
        f"In scaled modal coordinates {optimal} of {len(scaled)} are optimal to {_power(GAP)}, by "
        "the same inequalities and the same solver"
    )
    if optimal == len(scaled):
        cure = f"{said}: the stiffness is a matter of coordinates, and scaling cures it."
    elif len(gaps) == len(scaled) and max(gaps) <= 10 * GAP:
        cure = (
            f"{said}, and the others nearly so (at most {max(gaps):.1e}): the stiffness is a "
            "matter of coordinates, and scaling cures it."
        )
    else:
        cure = f"{said}: scaling helps, but does not cure every case."
    own = finding.own_gap
    if own is None:
        return f"{cure} slewctl's own inequality fails in one case at least."
    return f"{cure} slewctl's own inequality, given the raw matrices, stays within {_power(own)}."


def _power(value: float) -> str:
    """Return a number as a digit times a power of ten."""
    digit, exponent = f"{value:.0e}".split("e")
    power = f"10^{int(exponent)}".replace("-", "−")
    return power if digit == "1" else f"{digit}·{power}"
