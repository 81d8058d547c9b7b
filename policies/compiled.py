"""The decorator of every compiled function.

Compiled code is cached beside its source file. The cache knows when that file changes,
but not when a file it calls does: after editing a kernel, delete `__pycache__`.
"""

from collections.abc import Callable
from typing import TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile `function` on first use, without the interpreter lock.

    Arithmetic is IEEE (no fast-math), so a result is the same in every caller, to the
    bit. Division by zero gives infinity or NaN as in NumPy, not an exception.
    """
    try:
        kernel: Function = numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(
            function
        )
    except RuntimeError as error:  # a container without a writeable folder
        if "no locator" not in str(error):
            raise
        kernel = numba.njit(nogil=True, error_model="numpy", forceinline=True)(function)
    return kernel
