"""The commands ``modes`` and ``arms``."""

from __future__ import annotations

from rich.table import Table

from slewctl.arm import Arm, catalogue
from slewctl.basis import NAMES, create
from slewctl.breakdown import computing
from slewctl.cli.terminal import OUT, number_table, show
from slewctl.files import (
    computing_arm,
    find_arm,
)
from slewctl.model import BOUNDARIES, assemble, frequencies, truth


def print_modes(arm: str, orders: int, modes: int) -> None:
    """Print the natural frequencies of an arm by basis and number of functions."""
    chosen = find_arm(arm)
    table = number_table("basis", "n", *(f"f{k} (Hz)" for k in range(1, modes + 1)))
    with computing_arm(arm):
        exact = truth(chosen, max(modes, 10))
        for basis in NAMES:
            for n in range(1, orders + 1):
                found = assemble(chosen, create(basis, n)).frequencies_hz[:modes]
                cells = [f"{f:.6f}" for f in found] + ["-"] * (modes - len(found))
                table.add_row(basis, str(n), *cells)
    table.add_row("truth", "", *(f"{f:.6f}" for f in exact.frequencies_hz[:modes]))
    show(table)
    OUT.print(str(exact))


def print_arms(name: str | None) -> None:
    """List the catalogue, or tell all about one of its arms."""
    if name is None:
        table = number_table("name", "length (m)", "what it is")
        for key, entry in catalogue.CATALOGUE.items():
            table.add_row(key, f"{entry.build().beam.length:g}", entry.summary)
        show(table)
        OUT.print("more about one: slewctl arms NAME")
        return
    arm = catalogue.get(name)
    entry = catalogue.CATALOGUE[name]
    parts = {
        "hub": arm.hub,
        "payload": arm.payload,
        "motor": arm.motor,
        "joint": arm.joint,
        "actuator": arm.actuator,
    }
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
        computed = frequencies(arm, max([3, *printed]), boundary).hz
        for mode, hertz in enumerate(computed, start=1):
            beside = printed.get(mode)
            cells = ("", "") if beside is None else (f"{beside:g}", f"{hertz / beside - 1:+.2%}")
            table.add_row(boundary, str(mode), f"{hertz:.6g}", *cells)
    return table
