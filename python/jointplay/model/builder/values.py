"""What numbers, points and lists of the file may be in Python."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

#: a number, of NumPy as well, or an expression in variables of the file
Number: TypeAlias = float | str | np.floating[Any] | np.integer[Any]
#: a whole number
Count: TypeAlias = int | np.integer[Any]
#: a point, a direction or a list of numbers
Numbers: TypeAlias = Sequence[Number] | NDArray[Any]
#: a list of them
Rows: TypeAlias = Sequence[Numbers] | NDArray[Any]
