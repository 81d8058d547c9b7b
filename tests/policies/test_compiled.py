from collections.abc import Callable

import numba
import pytest

from policies.compiled import compiled


def double(value: int) -> int:
    return 2 * value


def refusing(reason: str) -> Callable[..., object]:
    """Return a compiler that cannot cache."""
    real: Callable[..., object] = numba.njit

    def compiler(function: object, *, cache: bool, **options: object) -> object:
        if cache:
            raise RuntimeError(reason)
        return real(function, cache=cache, **options)

    return compiler


def test_without_a_writeable_folder_functions_are_compiled_uncached(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reason = "cannot cache function 'double': no locator available for file 'x.py'"
    monkeypatch.setattr(numba, "njit", refusing(reason))

    assert compiled(double)(4) == 8


def test_other_errors_of_the_compiler_are_not_hidden(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(numba, "njit", refusing("something else"))

    with pytest.raises(RuntimeError, match="something else"):
        compiled(double)
