"""Read-only arrays for frozen dataclasses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def frozen_array(values: ArrayLike, dtype: Any) -> NDArray[Any]:
    """Return a read-only copy of ``values``, or the array itself if it is read-only and of that type already."""
    if isinstance(values, np.ndarray) and values.dtype == np.dtype(dtype) and not values.flags.writeable:
        return values
    copy = np.array(values, dtype=dtype)
    copy.flags.writeable = False
    return copy


def sealed(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array read-only and return it; for a new array that nothing else refers to."""
    array.flags.writeable = False
    return array
