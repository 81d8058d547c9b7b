"""The two kinds of array that compiled code takes."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def as_floats(values: ArrayLike) -> Floats:
    """Return `values` as float64, contiguous and writeable; copied only if needed.

    Compiled code is built once for each kind of array it meets: a read-only or strided
    one would cost seconds of compilation in the middle of a request.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    return array if array.flags.writeable else array.copy()


def as_ints(values: ArrayLike) -> Ints:
    """Return `values` as int64, contiguous and writeable; copied only if needed."""
    array = np.ascontiguousarray(values, dtype=np.int64)
    return array if array.flags.writeable else array.copy()
