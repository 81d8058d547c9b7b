"""The policies by name: a new one is one file and one line here."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from policies.best_fixed import BestFixed
from policies.myopic import Myopic
from policies.parameters import parameters
from policies.policy import Policy
from policies.rollout import Rollout
from policies.round_robin import RoundRobin
from policies.uniform import Uniform
from policies.whittle_mc import WhittleMC

POLICIES: Mapping[str, type[Policy]] = MappingProxyType(
    {
        "random": Uniform,
        "round_robin": RoundRobin,
        "myopic": Myopic,
        "best_fixed": BestFixed,
        "rollout": Rollout,
        "whittle_mc": WhittleMC,
    }
)


def create(
    name: str,
    params: Mapping[str, object],
    policies: Mapping[str, type[Policy]] = POLICIES,
) -> Policy:
    """Make a policy from its name and parameters; those left out have defaults.

    Raises:
        ValueError: the name is unknown, or a parameter is unknown or out of range;
            names the field.
    """
    if name not in policies:
        raise ValueError(f"policy: must be one of {', '.join(policies)}, not {name!r}")
    known = {parameter.name for parameter in parameters(policies[name])}
    for field in params:
        if field not in known:
            raise ValueError(f"{field}: {name} has no such parameter")
    build: Callable[..., Policy] = policies[name]
    return build(**params)
