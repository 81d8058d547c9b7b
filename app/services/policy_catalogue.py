"""What policies there are to choose from, in plain words for forms and documents."""

import inspect
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from app.domain import Described, PolicyVersion
from app.errors import Fault, InvalidRequest, NotReady
from policies import (
    POLICIES,
    Bounds,
    Parameter,
    Policy,
    create,
    parameters,
    params_of,
    presets,
)


@dataclass(frozen=True, slots=True)
class Option:
    """One parameter of a policy, and its value where none is given."""

    parameter: Parameter
    default: object

    @property
    def name(self) -> str:
        return self.parameter.name

    @property
    def bounds(self) -> Bounds | None:
        return self.parameter.bounds


@dataclass(frozen=True, slots=True)
class Choice:
    """One policy that may be put in force. A preset stands for several options."""

    name: str
    summary: str
    options: Sequence[Option]
    presets: Sequence[str]

    @property
    def follows_another(self) -> bool:
        """Whether an option is another policy, which is none that does so itself."""
        return any(option.parameter.is_policy for option in self.options)


def choices(policies: Mapping[str, type[Policy]] = POLICIES) -> Iterator[Choice]:
    """Every policy, in the order of the registry."""
    for name, policy in policies.items():
        defaults = params_of(create(name, {}, policies), policies)
        options = [
            Option(parameter, defaults[parameter.name])
            for parameter in parameters(policy)
        ]
        summary = (inspect.getdoc(policy) or "").partition("\n\n")[0]
        yield Choice(name, summary.replace("\n", " "), options, list(presets(policy)))


def complete(name: str, params: Mapping[str, object]) -> Mapping[str, object]:
    """These parameters, checked, with the defaults of those left out.

    Raises:
        ValueError: names the field at fault.
    """
    return params_of(create(name, params))


def plain(policy: Described) -> Described:
    """A policy with all of its parameters, as they are kept.

    Raises:
        ValueError: names the field at fault.
    """
    params = json.loads(json.dumps(dict(complete(policy.name, policy.params))))
    return Described(policy.name, params)


def checked(policy: Described, at: str = "") -> Described:
    """The same, for one that a client has sent in a field, `at`, with a dot.

    Raises:
        InvalidRequest: names the field at fault.
    """
    try:
        return plain(policy)
    except ValueError as error:
        field, _, message = str(error).partition(": ")
        fault = Fault(f"{at}params.{field}", message)
        raise InvalidRequest(f"This is no policy: {error}.", fault) from error


def made(policy: Described | PolicyVersion) -> Policy:
    """The policy that is described, or was put in force under a version."""
    try:
        return create(policy.name, policy.params)
    except ValueError as error:
        raise NotReady(f"This release has no such policy: {error}.") from error
