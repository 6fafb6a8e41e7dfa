"""Types used throughout: arrays that are real, complex, integer and boolean, and paths."""

from os import PathLike

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]
FilePath = str | PathLike[str]
