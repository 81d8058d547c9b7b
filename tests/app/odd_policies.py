"""Policies as nobody should write them, each in the form that any policy has."""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal

import numpy as np
import pytest

from app.api.schemas.policy import FORMS, forms_of
from app.services import policy_catalogue
from policies import (
    POLICIES,
    Bounds,
    Floats,
    ModelSet,
    Policy,
    Scorer,
    Situation,
    Tables,
    registry,
)
from policies.parameters import check

released = threading.Event()


class Broken(Exception):
    """What a policy in error raises."""


@dataclass(frozen=True, slots=True)
class Fails:
    """Raises an error where it is told to."""

    rest_matters: ClassVar[bool] = True
    is_index: ClassVar[bool] = False
    table_discount: ClassVar[None] = None

    where: Annotated[
        Literal["score", "prepare", "cost", "number"], "where it raises"
    ] = "score"

    def __post_init__(self) -> None:
        check(self)

    def prepare(self, _models: ModelSet, _tables: Tables) -> Scorer:
        if self.where == "prepare":
            raise Broken("it cannot be prepared")
        return self._scores

    def cost(self, _situation: Situation) -> float:
        if self.where == "cost":
            raise Broken("it does not know its cost")
        return 1.0

    def _scores(self, situation: Situation, _seed: int) -> Floats:
        if self.where == "number":
            return np.full(len(situation.model), np.nan)
        raise Broken("it cannot score")


@dataclass(frozen=True, slots=True)
class Sleeps:
    """Says that it is quick, and sleeps until it is told to wake up."""

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = True
    table_discount: ClassVar[None] = None

    says: Annotated[float, Bounds(0, 1e12), "microseconds that it foretells"] = 1.0

    def __post_init__(self) -> None:
        check(self)

    def prepare(self, _models: ModelSet, _tables: Tables) -> Scorer:
        return self._scores

    def cost(self, _situation: Situation) -> float:
        return self.says

    def _scores(self, situation: Situation, _seed: int) -> Floats:
        released.wait(60)
        return -np.arange(len(situation.model), dtype=np.float64)


@contextmanager
def registered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """As if each had its file, and its line in the registry."""
    odd: Mapping[str, type[Policy]] = {"fails": Fails, "sleeps": Sleeps}
    every = MappingProxyType({**POLICIES, **odd})
    functions = (
        registry.create,
        registry.params_of,
        registry.description,
        policy_catalogue.choices,
    )
    for function in functions:
        monkeypatch.setattr(function, "__defaults__", (every,))
    for name, form in forms_of(policy_catalogue.choices(every)).items():
        monkeypatch.setitem(FORMS, name, form)
    released.clear()
    yield
    released.set()
