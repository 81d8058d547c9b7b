"""What answers are worth, as the model says by whose version a play was chosen."""

from collections.abc import Mapping

from app.storage import models
from app.storage.store import Store


class Rewards:
    """Rewards of signals, by model and version; each version is read once."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, int], Mapping[str, float]] = {}

    def of(
        self, store: Store, model: str, version: int, signal: str | None
    ) -> float | None:
        """What a play has earned, None if it has no answer that has a reward."""
        key = model, version
        if key not in self._known:
            found = models.version(store, model, version)
            self._known[key] = {} if found is None else found.rewards
        return self._known[key].get(signal or "")
