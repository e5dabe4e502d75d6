"""Arrays of any shape by what is in them, for annotations."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Texts = NDArray[np.str_]
#: statuses and other small numbers of the core
Codes = NDArray[np.uint8]
Array = NDArray[Any]
