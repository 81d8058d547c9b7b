"""Import of models: all of a file in one unit of work, or none."""

import asyncio
from collections.abc import Sequence
from functools import partial

from app.errors import Fault, UnusableModel
from app.services import models, mood_rules, new_models
from app.services.changes import Change, Imported
from app.services.lines import LineFile
from app.services.new_models import NewModel
from app.storage import revision
from app.storage.database import Database
from app.storage.store import Store


async def import_models(
    database: Database, file: LineFile[NewModel], *, by: str, dry_run: bool = False
) -> Imported:
    """Create and replace the models of a file."""
    new = await asyncio.to_thread(read, file)
    land = partial(_land, new=new, by=by, dry_run=dry_run)
    return await database.run_in_turn(land)


def read(file: LineFile[NewModel]) -> Sequence[NewModel]:
    """The models of a file, each of which is one."""
    faults = file.faults()
    new: dict[str, NewModel] = {}
    for line, model in file.entries(faults):
        if model.id in new:
            faults.add(line, Fault("id", "is there twice", model.id))
        new[model.id] = model
        try:
            new_models.check(model)
        except UnusableModel as error:
            faults.add(line, *error.faults)
    faults.refuse()
    return [*new.values()]


def _land(store: Store, new: Sequence[NewModel], by: str, *, dry_run: bool) -> Imported:
    known = revision.current(store)
    outcomes = [models.outcome(store, model) for model in new]
    if dry_run:
        mood_rules.check(store, known, [each.model for each in outcomes])
    else:
        models.put_all(store, known, outcomes, by)
    changes = [outcome.change for outcome in outcomes]
    created, replaced, unchanged = map(changes.count, Change)
    found = {each.model.id: each.warnings for each in outcomes}
    warnings = {model: told for model, told in found.items() if told}
    return Imported(created, replaced, unchanged, 0, dry_run, warnings)
