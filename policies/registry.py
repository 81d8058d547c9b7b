"""The policies by name: a new one is one file and one line here."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from policies.best_fixed import BestFixed
from policies.epsilon import Epsilon
from policies.exact_rollout import ExactRollout
from policies.lagrangian import Lagrangian
from policies.myopic import Myopic
from policies.parameters import follows_another, parameters
from policies.policy import Policy
from policies.rollout import Rollout
from policies.round_robin import RoundRobin
from policies.thompson import Thompson
from policies.uniform import Uniform
from policies.whittle import Whittle
from policies.whittle_mc import WhittleMC

POLICIES: Mapping[str, type[Policy]] = MappingProxyType(
    {
        "random": Uniform,
        "round_robin": RoundRobin,
        "myopic": Myopic,
        "best_fixed": BestFixed,
        "rollout": Rollout,
        "exact_rollout": ExactRollout,
        "whittle": Whittle,
        "lagrangian": Lagrangian,
        "whittle_mc": WhittleMC,
        "epsilon": Epsilon,
        "thompson": Thompson,
    }
)


PRESET = "preset"  # a parameter that stands for others


def presets(policy: type[Policy]) -> Mapping[str, Mapping[str, object]]:
    """Return the parameters that go by a name of their own, by that name."""
    found: Mapping[str, Mapping[str, object]] = getattr(policy, "presets", {})
    return found


def create(
    name: str,
    params: Mapping[str, object],
    policies: Mapping[str, type[Policy]] = POLICIES,
) -> Policy:
    """Make a policy from its name and parameters; those left out have defaults.

    The parameter "preset" stands for several, which others may still overrule.

    A policy that another one follows is given as {"name": ..., "params": {...}}, too.

    Raises:
        ValueError: the name is unknown, or a parameter is unknown or out of range;
            names the field, such as "horizon" or "policy.params.horizon".
    """
    if name not in policies:
        raise ValueError(f"name: must be one of {', '.join(policies)}, not {name!r}")
    values = {**_preset(policies[name], params), **params}
    values.pop(PRESET, None)
    known = {parameter.name: parameter for parameter in parameters(policies[name])}
    for field, value in values.items():
        if field not in known:
            raise ValueError(f"{field}: {name} has no such parameter")
        if known[field].is_policy and isinstance(value, Mapping):
            values[field] = _followed(field, value, policies)
    build: Callable[..., Policy] = policies[name]
    return build(**values)


def params_of(
    policy: Policy, policies: Mapping[str, type[Policy]] = POLICIES
) -> dict[str, object]:
    """Return all parameters of a policy, as `create` takes them."""
    params: dict[str, object] = {}
    for parameter in parameters(type(policy)):
        value = getattr(policy, parameter.name)
        if parameter.is_policy:
            name, followed = description(value, policies)
            value = {"name": name, "params": followed}
        params[parameter.name] = value
    return params


def description(
    policy: Policy, policies: Mapping[str, type[Policy]] = POLICIES
) -> tuple[str, dict[str, object]]:
    """Return the name of a policy, and all of its parameters."""
    names = {kind: name for name, kind in policies.items()}
    return names[type(policy)], params_of(policy, policies)


def _preset(policy: type[Policy], params: Mapping[str, object]) -> Mapping[str, object]:
    if PRESET not in params:
        return {}
    known = presets(policy)
    name = params[PRESET]
    if not isinstance(name, str) or name not in known:
        allowed = f"one of {', '.join(known)}" if known else "left out"
        raise ValueError(f"{PRESET}: must be {allowed}, not {name!r}")
    return known[name]


def _followed(
    field: str, description: Mapping[str, object], policies: Mapping[str, type[Policy]]
) -> Policy:
    """Make a policy that another one follows."""
    plain = {name: kind for name, kind in policies.items() if not follows_another(kind)}
    name, params = description.get("name"), description.get("params", {})
    if description.keys() - {"name", "params"} or not isinstance(params, Mapping):
        raise ValueError(f"{field}: must be a name and params, not {description!r}")
    if not isinstance(name, str) or name not in plain:
        known = ", ".join(plain)
        raise ValueError(f"{field}.name: must be one of {known}, not {name!r}")
    try:
        return create(name, params, plain)
    except ValueError as error:
        raise ValueError(f"{field}.params.{error}") from error
