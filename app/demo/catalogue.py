"""The demo's catalogue: the paper's example 2, and sixty invented tracks of four types.

Anthems grow with every play and burn out at their height. Earworms are liked at once,
tire fast and return slowly. Ambient tracks are steady. Growers begin low and rise with
repetition. A type has three models, which differ in what is believed of a new user.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import TypeVar

from app.api.schemas.lines import ITEMS, MODELS
from app.services import items
from app.services.formats import Format
from app.services.imports import import_items
from app.services.lines import Layout, LineFile
from app.services.live import Live
from app.services.model_imports import import_models
from app.storage.database import Database
from app.web.files import HERE

T = TypeVar("T")
DATA = HERE / "static" / "demo"  # where the pages find it, too
BY = "encore demo"


async def ensure(database: Database, live: Live) -> None:
    """Import the demo's catalogue where there is none."""
    if await database.run(partial(items.page, after="", limit=1, retired=True)):
        return
    with _opened("models.ndjson", MODELS) as models:
        await import_models(database, models, by=BY)
    with _opened("items.ndjson", ITEMS) as lines:
        await import_items(database, live, lines, by=BY)


@contextmanager
def _opened(name: str, layout: Layout[T]) -> Iterator[LineFile[T]]:
    with (DATA / name).open("rb") as file:
        yield LineFile(file, Format.NDJSON, layout)
