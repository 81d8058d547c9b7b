"""The policy that the guard falls back to."""

import json
from collections.abc import Mapping
from dataclasses import dataclass

from app.domain import PolicyVersion
from app.services.policy_catalogue import complete
from app.settings import Settings

BLIND = {"random", "round_robin"}  # policies that ask no model


@dataclass(frozen=True, slots=True)
class Fallback:
    """A policy to put in force when models fail."""

    name: str
    params: Mapping[str, object]

    @classmethod
    def of(cls, settings: Settings) -> "Fallback":
        """The one that is set.

        Raises:
            ValueError: names the setting, and what is wrong with it.
        """
        try:
            name, params = _parts(settings.guard_policy)
            plain = json.dumps(dict(complete(name, params)))  # as policies are kept
            return cls(name, json.loads(plain))
        except ValueError as error:
            raise ValueError(f"ENCORE_GUARD_POLICY: {error}") from error

    def would_help(self, present: PolicyVersion) -> bool:
        """Whether it differs from a policy, which asks the models."""
        same = (present.name, present.params) == (self.name, self.params)
        return not same and present.name not in BLIND


def in_use(settings: Settings) -> Fallback | None:
    """The policy to fall back to, None if it is not to be used."""
    fallback = Fallback.of(settings)
    return fallback if settings.guard == "fall_back" else None


def _parts(text: str) -> tuple[str, Mapping[str, object]]:
    """Name and parameters: of JSON, or only a name."""
    if not text.lstrip().startswith("{"):
        return text.strip(), {}
    form = json.loads(text)
    name, params = form.pop("name", None), form.pop("params", {})
    if form or not isinstance(name, str) or not isinstance(params, dict):
        raise ValueError('must be a name, or {"name": "…", "params": {…}}')
    return name, params
