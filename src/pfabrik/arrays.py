"""Types of arrays, and the conversion of rows to the shape of a batch."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]
Records: TypeAlias = NDArray[np.void]
Record: TypeAlias = Any  # one of them: its fields are numbers and arrays


def shaped(array: NDArray[Any], shape: tuple[int, ...]) -> Any:
    """Results row by row, (n, ...), in the batch shape of the question; a number if that shape is ()."""
    found = array.reshape(shape + array.shape[1:])
    return found if found.ndim else found.item()
