"""Design files: TOML in, frozen cases and requirements out."""

from slewctl.files.lines import key_lines
from slewctl.files.reader import (
    DesignFile,
    find_arm,
    find_designs,
    name_designs,
    read_arm,
    read_design,
    read_designs,
)
from slewctl.files.source import Source, read_source
from slewctl.files.study_file import read_study
from slewctl.files.variations import Variation

__all__ = [
    "DesignFile",
    "Source",
    "Variation",
    "find_arm",
    "find_designs",
    "key_lines",
    "name_designs",
    "read_arm",
    "read_design",
    "read_designs",
    "read_source",
    "read_study",
]
