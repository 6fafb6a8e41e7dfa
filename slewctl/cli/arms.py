"""The commands ``modes`` and ``arms``."""

from __future__ import annotations

from rich.table import Table

from slewctl._types import Array
from slewctl.arm import Arm, ModalData, catalogue
from slewctl.basis import bases_of, create
from slewctl.breakdown import computing
from slewctl.cli.terminal import OUT, next_step, number_table, show
from slewctl.compare import unit_notes
from slewctl.files import (
    computing_arm,
    find_arm,
)
from slewctl.model import BOUNDARIES, frequencies, truth
from slewctl.model.locked import ritz_frequencies_hz
from slewctl.model.ritz import Boundary


def print_modes(arm: str, orders: int, modes: int, locked: bool = False) -> None:
    """Print the natural frequencies of an arm by basis and number of functions."""
    chosen = find_arm(arm)
    boundary: Boundary = "hub-locked" if locked else "free"
    table = number_table("basis", "n", *(f"f{k} (Hz)" for k in range(1, modes + 1)))

    def add(name: str, n: str, hertz: Array) -> None:
        cells = [f"{f:.6f}" for f in hertz[:modes]]
        table.add_row(name, n, *cells, *["-"] * (modes - len(cells)))

    with computing_arm(arm):
        for basis in bases_of(chosen):
            for n in range(1, _most_functions(chosen, orders) + 1):
                functions = create(basis, n).matched_to(chosen)
                add(basis, str(n), ritz_frequencies_hz(chosen, functions, boundary))
        if locked:
            exact, told = (
                frequencies(chosen, _most_functions(chosen, modes)).hz,
                f"{chosen.name} with its hub held",
            )
        else:
            model = truth(chosen, max(modes, 10))
            exact, told = model.frequencies_hz, str(model)
        notes = unit_notes(chosen)
    add("truth", "", exact)
    show(table)
    OUT.print(told)
    for note in notes:
        OUT.print(f"note: {note}", soft_wrap=True)
    next_step(f"slewctl recommend {arm}", "which basis, how many functions, how fast")


def _most_functions(arm: Arm, wanted: int) -> int:
    """Return a number of modes or functions, not more than the arm's data have."""
    return min(wanted, arm.beam.modes) if isinstance(arm.beam, ModalData) else wanted


def print_arms(name: str | None) -> None:
    """List the catalogue, or tell all about one of its arms."""
    if name is None:
        table = number_table("name", "length (m)", "what it is")
        for key, entry in catalogue.CATALOGUE.items():
            beam = entry.build().beam
            length = "-" if isinstance(beam, ModalData) else f"{beam.length:g}"
            table.add_row(key, length, entry.summary)
        show(table)
        OUT.print("more about one: slewctl arms NAME")
        return
    arm = catalogue.get(name)
    entry = catalogue.CATALOGUE[name]
    parts: dict[str, object] = {
        "hub": arm.hub,
        "payload": arm.payload,
        "motor": arm.motor,
        "joint": arm.joint,
        "actuator": arm.actuator,
    }
    if isinstance(arm.beam, ModalData):
        parts["modal data"] = arm.beam
    if arm.masses:
        parts["masses"] = arm.masses
    texts = {"what": entry.summary, "source": entry.source, "uncertain": entry.uncertain}
    texts["damping ratio to design with"] = str(entry.damping)
    for title, text in {**texts, **parts}.items():
        OUT.print(f"{title}: {text}")
    with computing(name):
        table = _published(arm, entry)
    show(table)


def _published(arm: Arm, entry: catalogue.Entry) -> Table:
    """Return the arm's first frequencies, hub locked and free, beside those in print."""
    table = number_table("hub", "mode", "computed (Hz)", "published (Hz)", "difference")
    for boundary in BOUNDARIES:
        if boundary == "rotor-locked" and arm.joint is None:
            continue
        printed = {
            mode: hertz
            for published in entry.published
            if published.boundary == boundary
            for mode, hertz in published.frequencies_hz
        }
        computed = frequencies(arm, _most_functions(arm, max([3, *printed])), boundary).hz
        for mode, hertz in enumerate(computed, start=1):
            beside = printed.get(mode)
            cells = ("", "") if beside is None else (f"{beside:g}", f"{hertz / beside - 1:+.2%}")
            table.add_row(boundary, str(mode), f"{hertz:.6g}", *cells)
    return table
