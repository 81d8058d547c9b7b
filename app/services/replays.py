"""Decisions taken again: from the log, the models and the seed, to the same item."""

from dataclasses import dataclass
from functools import partial

from app.domain import Play, Revision
from app.services import beliefs, decisions, index_tables, moods, selections, slates
from app.services.catalogue import Catalogue, Shelf
from app.services.decisions import Decision
from app.services.live import Live
from app.services.mathematics import stacked
from app.storage import index_tables as stored
from app.storage import items, models, plays, revision, users
from app.storage.store import Store


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """A decision, and the catalogue from which it was taken."""

    catalogue: Catalogue
    decision: Decision


def is_known(store: Store, play: Play) -> bool:
    """Whether the plays are there still that a play was chosen by."""
    _, replayed_from = users.kept(store, play.user)
    return play.slot >= replayed_from


def replay(store: Store, live: Live, play: Play) -> Replay:
    """The decision that led to a recommended play, from what was known then."""
    if play.policy is None or play.seed is None:
        raise ValueError(f"play {play.id} was not recommended")
    catalogue = _catalogue_of(store, live, play)
    rung = live.rung(store, play.policy, play.rung or 0, catalogue)
    log = plays.closed(store, play.user, before=play.slot)
    entries = beliefs.rebuilt(catalogue, log, play.slot)
    now = beliefs.at(catalogue, entries, play.slot)
    pool = selections.pool(catalogue, play.selection)
    felt = moods.begun(catalogue, entries.felt, play.slot, play.created_at)
    candidates = decisions.candidates(catalogue, pool, now, rung.policy, felt)
    together = [item for item, _ in plays.of_slate(store, play)]
    before = together[: play.place]
    decide = partial(
        slates.decide_next, candidates, rung, play.seed, before, len(together)
    )
    return Replay(catalogue, store.aside(decide))


def _catalogue_of(store: Store, live: Live, play: Play) -> Catalogue:
    present = live.catalogue(store, revision.current(store))
    if present.version == play.catalogue:
        return present
    listing = present.listing.copy()
    for row in items.before(store, play.catalogue):
        shelf = Shelf(row.id, "", row.tags or (), {})
        listing.put(row.serial, shelf, row.model or "", active=bool(row.active))
    versions = models.at(store, play.catalogue)
    published = stored.published(store, -1, play.catalogue)
    tables = index_tables.followed((), published, versions)
    then = Revision(play.catalogue, play.catalogue, 0)
    build = partial(Catalogue.build, then, versions, tables, listing, stacked(versions))
    return store.aside(build)
