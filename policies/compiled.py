"""The decorators of compiled functions.

Compiled code is cached beside its source file. The cache knows when that file changes,
but not when a file it calls does: after editing a kernel, delete `__pycache__`.
"""

import os
from collections.abc import Callable
from typing import TypeVar

import numba
from numba.core import config
from numba.core.options import DefaultOptions

# Measured here: as fast as the highest level, and compiled in half the time.
if "NUMBA_OPT" not in os.environ:
    vars(config)["OPT"] = type(vars(config)["OPT"])(1)

Function = TypeVar("Function", bound=Callable[..., object])

# Arrays are counted at each use, atomically, and that is most of the time of a function
# that only reads and writes numbers (measured: five times the rest). Numba's own code
# turns the counting off like this; should the option go, its default is merely slow.
_UNCOUNTED = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}


def compiled(function: Function) -> Function:
    """Compile `function` on first use, without the interpreter lock.

    Arithmetic is IEEE (no fast-math), so a result is the same in every caller, to the
    bit. Division by zero gives infinity or NaN as in NumPy, not an exception.
    """
    return _compiled(function, {})


def inner(function: Function) -> Function:
    """Compile a function that only compiled code calls, into its callers.

    It may make no array and no view of one, and return none.
    """
    return _compiled(function, {"forceinline": True, **_UNCOUNTED})


def _compiled(function: Function, options: dict[str, bool]) -> Function:
    try:
        kernel = _jit(function, cache=True, **options)
    except RuntimeError as error:  # a container without a writeable folder
        if "no locator" not in str(error):
            raise
        kernel = _jit(function, cache=False, **options)
    return kernel


def _jit(function: Function, **options: bool) -> Function:
    jit: Callable[..., Function] = numba.njit  # type: ignore[assignment]  # a wrapper
    return jit(function, nogil=True, error_model="numpy", **options)


@inner
def variable(value: int) -> int:
    """Return `value`, as a number that is not known when compiling.

    A function that is called with a constant is compiled for that very constant, once
    more than needed; and so is all that it calls.
    """
    return value + 0
