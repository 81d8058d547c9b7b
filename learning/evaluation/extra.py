"""Imports of packages that only an extra installs."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def extra() -> Iterator[None]:
    """Say which extra installs what turns out to be missing.

    Raises:
        ModuleNotFoundError: a package is missing.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        name = (error.name or "").partition(".")[0]
        message = f"{name} is missing: it comes with the extra `learn`"
        raise ModuleNotFoundError(message, name=name) from error
