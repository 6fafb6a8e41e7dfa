"""``[uncertainty]``: the box of an arm's properties in which the worst arm is sought."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from slewctl import compare
from slewctl.arm import Arm
from slewctl.compare.arm_box import box_bounds
from slewctl.compare.quantities import QUANTITIES, UNWEIGHTED, WEIGHTED
from slewctl.errors import Faults, InputError, check_choice
from slewctl.plant import Objective

WORST = "worst of the box"
"""What the gate calls the worst arm."""


@dataclass(frozen=True)
class Uncertainty:
    """What `slewctl.worst_case` is asked.

    Attributes
    ----------
    box : mapping of str to (float, float)
    quantity : str
    samples, searches : int
    evaluations, seed : int or None
    """

    box: Mapping[str, tuple[float, float]]
    quantity: str
    samples: int
    searches: int
    evaluations: int | None = None
    seed: int | None = None

    @property
    def asked(self) -> dict[str, Any]:
        """The keywords of `slewctl.worst_case`."""
        names = ("quantity", "samples", "searches", "evaluations", "seed")
        return {name: getattr(self, name) for name in names}

    @property
    def most_arms(self) -> int:
        """How many arms are tried at the most."""
        return compare.most_arms(len(self.box), self.samples, self.searches, self.evaluations)


def read_uncertainty(
    table: Mapping[str, Any], arm: Arm, variations: Iterable[str]
) -> Uncertainty | None:
    """Return what a design file asks of the worst arm; None where a key of it is wrong or missing.

    Raises
    ------
    InputError
        For each property that `vary` does not know, impossible range and unknown quantity.
    """
    faults = Faults()
    box = {name: tuple(ends) for name, ends in table.get("box", {}).items()}
    for name, ends in box.items():
        faults.attempt(box_bounds, {name: ends}, arm)
    if not faults and "box" in table:
        faults.attempt(box_bounds, box, arm)
    if "quantity" in table:
        faults.attempt(check_choice, table["quantity"], QUANTITIES, "quantity")
    for name, count in (("seed", "samples"), ("evaluations", "searches")):
        if table.get(name) is not None and table.get(count) == 0:
            faults.add([InputError(f"means nothing with {count} = 0", where=name,
                                   remedy="leave it out")])  # fmt: skip
    if WORST in variations:
        faults.add([InputError(f"a variation is called {WORST!r} too", where="box",
                               remedy="give it another name")])  # fmt: skip
    try:
        faults.tell()
    except InputError as error:
        raise error.within("uncertainty", ".") from error
    if not table.keys() >= {each.name for each in fields(Uncertainty)}:
        return None
    return Uncertainty(**{**table, "box": box})


def refuse_unweighed(uncertainty: Uncertainty, objective: Objective) -> None:
    """Refuse a quantity on what limits and noise weigh, in a file without them."""
    if QUANTITIES[uncertainty.quantity].kind in WEIGHTED and not objective.weighted:
        raise InputError(
            UNWEIGHTED,
            where="uncertainty.quantity",
            remedy="add controller.limits and controller.noise",
        )
