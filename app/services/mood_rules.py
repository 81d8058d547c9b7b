"""One rule by which answers make a mood, for all models of a catalogue."""

from collections.abc import Iterable, Sequence

from app.domain import ItemModel, ItemMood, MoodRule, Revision
from app.errors import Fault, MoodsDiffer
from app.storage import models
from app.storage.store import Store


def common(moods: Iterable[tuple[str, ItemMood | None]]) -> MoodRule | None:
    """The rule of all models, by id, that have a mood; none if none has."""
    found: tuple[str, MoodRule] | None = None
    for model, mood in moods:
        if mood is None:
            continue
        if found is None:
            found = model, mood.rule
        elif mood.rule != found[1]:
            fault = Fault("mood", f"not that of model {found[0]!r}", model)
            raise MoodsDiffer(
                f"The models {found[0]!r} and {model!r} have different moods: import"
                " all models that have one together.",
                fault,
            )
    return None if found is None else found[1]


def check(
    store: Store,
    known: Revision,
    changed: Sequence[ItemModel],
    ended: Sequence[ItemModel] = (),
) -> bool:
    """Refuse changes after which rules differ; tell whether the rule becomes another.

    Then what is kept about users' moods has another meaning, or is yet to be found.
    """
    before = {model.id: model for model in models.at(store, known.catalogue)}
    after = before | {model.id: model for model in changed}
    for model in ended:
        after.pop(model.id, None)
    rule = common((model.id, model.mood) for model in after.values())
    return rule is not None and rule != common(
        (model.id, model.mood) for model in before.values()
    )
