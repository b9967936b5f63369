"""Read-only arrays inside frozen values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def frozen_array(values: ArrayLike, dtype: Any) -> NDArray[Any]:
    """A read-only copy of ``values``; an array that is read-only already and of that type is kept as it is."""
    if isinstance(values, np.ndarray) and values.dtype == np.dtype(dtype) and not values.flags.writeable:
        return values
    copy = np.array(values, dtype=dtype)
    copy.flags.writeable = False
    return copy


def sealed(array: NDArray[Any]) -> NDArray[Any]:
    """The array itself, made read-only: for one that was just made and that nobody else holds."""
    array.flags.writeable = False
    return array
