"""From the filters of a request to the items that may be played."""

import numpy as np

from app.domain import Selection
from app.errors import Fault, NothingToPlay, UnknownItems
from app.services.catalogue import Catalogue
from app.services.pool import Pool
from policies import Ints


def pool(catalogue: Catalogue, selection: Selection) -> Pool:
    """The active items that a selection leaves."""
    chosen = catalogue.with_tags(selection.tags)
    if selection.candidates is not None:
        named = np.unique(_serials(catalogue, "candidate", selection.candidates))
        remaining = named[chosen.holds(named)]
        chosen = Pool.of(remaining, catalogue.model, len(catalogue.versions))
    if selection.excluded:
        chosen = chosen.without(_serials(catalogue, "exclude", selection.excluded))
    if chosen.is_empty:
        raise NothingToPlay(_why(catalogue, selection))
    return chosen


def _serials(catalogue: Catalogue, field: str, names: tuple[str, ...]) -> Ints:
    serials = [catalogue.serial_of(name) for name in names]
    known = [serial for serial in serials if serial is not None]
    if len(known) < len(serials):
        raise UnknownItems(
            f"{len(serials) - len(known)} of {len(serials)} items are unknown.",
            *(
                Fault(f"{field}.{place}", "unknown item", name)
                for place, (name, serial) in enumerate(zip(names, serials, strict=True))
                if serial is None
            ),
        )
    return np.array(known, np.int64)


def _why(catalogue: Catalogue, selection: Selection) -> str:
    if len(catalogue.pool.serials) == 0:
        return "The catalogue has no active item."
    if selection.tags and len(catalogue.with_tags(selection.tags).serials) == 0:
        return f"No active item carries all of the tags {', '.join(selection.tags)}."
    return "The filters leave no active item."
