"""What numbers, points and lists of the file may be in Python."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

#: a number, of NumPy as well, or an expression in variables of the file
NumberLike: TypeAlias = float | str | np.floating[Any] | np.integer[Any]
#: a whole number
Count: TypeAlias = int | np.integer[Any]
#: a point, a direction or a list of numbers
NumbersLike: TypeAlias = Sequence[NumberLike] | NDArray[Any]
#: a list of them
RowsLike: TypeAlias = Sequence[NumbersLike] | NDArray[Any]
