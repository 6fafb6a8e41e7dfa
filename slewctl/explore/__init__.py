"""A design under sliders: the file is changed, and what becomes of the loop is seen at once."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.explore.changed_file import changed_text
    from slewctl.explore.knobs import Knob, knobs_of
    from slewctl.explore.result import Explored, explored

__all__ = ["Explored", "Knob", "changed_text", "explored", "knobs_of"]

__getattr__, __dir__ = attach(__name__, __file__)
