"""The policies by name: a new one is one file and one line here."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from policies.best_fixed import BestFixed
from policies.exact_rollout import ExactRollout
from policies.lagrangian import Lagrangian
from policies.myopic import Myopic
from policies.parameters import parameters
from policies.policy import Policy
from policies.rollout import Rollout
from policies.round_robin import RoundRobin
from policies.uniform import Uniform
from policies.whittle import Whittle

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

    Raises:
        ValueError: the name is unknown, or a parameter is unknown or out of range;
            names the field.
    """
    if name not in policies:
        raise ValueError(f"policy: must be one of {', '.join(policies)}, not {name!r}")
    params = {**_preset(policies[name], params), **params}
    params.pop(PRESET, None)
    known = {parameter.name for parameter in parameters(policies[name])}
    for field in params:
        if field not in known:
            raise ValueError(f"{field}: {name} has no such parameter")
    build: Callable[..., Policy] = policies[name]
    return build(**params)


def _preset(policy: type[Policy], params: Mapping[str, object]) -> Mapping[str, object]:
    if PRESET not in params:
        return {}
    known = presets(policy)
    name = params[PRESET]
    if not isinstance(name, str) or name not in known:
        allowed = f"one of {', '.join(known)}" if known else "left out"
        raise ValueError(f"{PRESET}: must be {allowed}, not {name!r}")
    return known[name]
