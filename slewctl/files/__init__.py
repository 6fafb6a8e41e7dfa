"""Design files: TOML in, frozen cases and requirements out."""

from typing import TYPE_CHECKING

from slewctl._lazy import attach

if TYPE_CHECKING:
    from slewctl.files.arm_table import computing_arm, find_arm, read_arm
    from slewctl.files.example import example_design
    from slewctl.files.find import designs_below, find_designs, is_study, name_designs
    from slewctl.files.lines import key_lines
    from slewctl.files.measured_file import read_measured as read_measured
    from slewctl.files.reader import DesignFile, design_of_text, read_design, read_designs
    from slewctl.files.source import Source, read_source
    from slewctl.files.starters import STARTERS, starter_files
    from slewctl.files.study_file import read_study
    from slewctl.files.variations import Variation

__all__ = [
    "STARTERS",
    "DesignFile",
    "Source",
    "Variation",
    "computing_arm",
    "design_of_text",
    "designs_below",
    "example_design",
    "find_arm",
    "find_designs",
    "is_study",
    "key_lines",
    "name_designs",
    "read_arm",
    "read_design",
    "read_designs",
    "read_source",
    "read_study",
    "starter_files",
]

__getattr__, __dir__ = attach(__name__, __file__)
