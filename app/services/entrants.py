"""Policies to be tried against each other."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from app.errors import Fault
from app.services.in_force import find_policy
from app.services.lines import LineFile
from app.services.policy_catalogue import made
from app.storage import revision
from app.storage.store import Store
from policies import POLICIES, Policy, create, parameters, params_of

DISCOUNT = "discount"


@dataclass(frozen=True, slots=True)
class NamedPolicy:
    """A policy as clients name it."""

    name: str
    params: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class Entrant:
    """A policy to try. `label`: what tells it from the others."""

    label: str
    name: str
    params: Mapping[str, object]
    policy: Policy


def entrant(name: str, params: Mapping[str, object], discount: float) -> Entrant:
    """A policy that plans at a discount, unless its parameters say otherwise.

    Raises:
        ValueError: names the field at fault.
    """
    usual: dict[str, object] = {}
    if name in POLICIES and any(p.name == DISCOUNT for p in parameters(POLICIES[name])):
        usual[DISCOUNT] = discount
    policy = create(name, {**usual, **params})
    told = json.dumps(params, ensure_ascii=False, separators=(",", ":"))
    label = f"{name}={told}" if params else name
    return Entrant(label, name, params_of(policy), policy)


def read(file: LineFile[NamedPolicy], discount: float) -> Sequence[Entrant]:
    """The policies of a file, each of which is one."""
    faults, found = file.faults(), list[Entrant]()
    for place, named in file.entries(faults):
        try:
            found.append(entrant(named.name, named.params, discount))
        except ValueError as error:
            field, _, message = str(error).partition(": ")
            faults.add(place, Fault(field, message))
    faults.refuse()
    return found


def with_the_one_in_force(
    store: Store, entrants: Sequence[Entrant]
) -> Sequence[Entrant]:
    """The policy in force, if there is one, and those that are other ones."""
    known = revision.current(store)
    if known.policy == 0:
        return entrants
    version = find_policy(store, known.policy)
    label = f"{version.name} (in force)"
    present = Entrant(label, version.name, version.params, made(version))
    others = [each for each in entrants if each.policy != present.policy]
    return [present, *others]
