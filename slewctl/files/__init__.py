"""Design files: TOML in, frozen cases and requirements out."""

from slewctl.files.reader import DesignFile, find_designs, read_arm, read_design, read_designs

__all__ = ["DesignFile", "find_designs", "read_arm", "read_design", "read_designs"]
