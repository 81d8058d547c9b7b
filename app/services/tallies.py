"""What the users of each arm do, counted from the log of plays, each play once.

The request path writes nothing for it. One count at a time, of whatever process, reads
on in the log, and adds to sums that are kept by user and by arm: so a report costs as
much as there are arms. As with the guard, reading waits for plays that have no answer
yet, since likes may come later than skips.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from uuid import UUID

from app.domain import Experiment
from app.play_ids import since
from app.services import arm_sums
from app.services.arm_sums import Added, Taken
from app.services.rewards import Rewards
from app.storage import experiments, revision, tallies
from app.storage.store import Store
from app.storage.tallies import PlayRow, Tally

PAGE = 500  # plays of one count
FIRST = 1  # version of the first experiment there is
EVER = datetime.min.replace(tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Terms:
    """When a play is counted.

    lag:    longest time that an answer is waited for
    settle: time after which a play is in the log if it ever will be: it is chosen here
            and written there, by clocks that may differ
    """

    lag: timedelta
    settle: timedelta = timedelta(minutes=1)


def is_due(store: Store, now: datetime, every: timedelta, terms: Terms) -> bool:
    """Whether there is something to count, and no process has just done so."""
    last = tallies.last(store)
    recent = last is not None and abs(now - last.checked_at) < every
    return not recent and _begin(store, last, terms) is not None


def count(store: Store, now: datetime, terms: Terms, rewards: Rewards) -> bool:
    """Read a page on in the log; tell whether there is more.

    rewards: of answers; what is missing is read
    """
    number, last = revision.tallies(store), tallies.last(store)
    begin = _begin(store, last, terms)
    if begin is None:
        return False
    settled = now - terms.settle
    page = tallies.plays_between(store, begin, since(settled), PAGE)
    read = _answered(page, now - min(terms.lag, now - EVER))
    _add(store, read, rewards)
    more = len(read) == PAGE
    waiting = page[len(read) :] or (read[-1:] if more else ())
    until = waiting[0].created_at if waiting else settled
    tallies.go_on(store, Tally(read[-1].id if read else begin, until, now))
    revision.advance_tallies(store, number)
    return more


def _begin(store: Store, last: Tally | None, terms: Terms) -> UUID | None:
    """The play to read on after, None if all plays of experiments are counted."""
    newest = next(iter(experiments.page(store, experiments.LATEST, 1)), None)
    if newest is None:
        return None
    if last is None:
        first = experiments.by_version(store, FIRST) or newest
        return since(first.at)
    if _is_counted(newest, last, terms):
        return None
    origin = experiments.by_version(store, newest.origin) or newest
    earlier = experiments.page(store, origin.version, 1)
    if all(_is_counted(one, last, terms) for one in earlier):
        return max(last.after, since(origin.at))
    return last.after


def _is_counted(experiment: Experiment, last: Tally, terms: Terms) -> bool:
    ended = experiment.ended_at
    return ended is not None and last.until >= ended + terms.settle


def _answered(page: Sequence[PlayRow], settled: datetime) -> Sequence[PlayRow]:
    """Plays up to the first of an experiment that may still be answered."""
    for place, play in enumerate(page):
        waits = play.closed is None and play.arm is not None
        if waits and play.created_at >= settled:
            return page[:place]
    return page


def _add(store: Store, read: Sequence[PlayRow], rewards: Rewards) -> None:
    """Note what plays add to their users and arms."""
    origins = _origins(store, read)
    plays = [
        Taken(play.user, (origins[play.experiment], play.arm), reward)
        for play in read
        if play.experiment is not None and play.arm is not None
        for reward in (rewards.of(store, play.model, play.version, play.signal),)
    ]
    known = tallies.users(store, {play.user for play in plays})
    added = Added.of(plays, known)
    tallies.keep_users(store, added.latest)
    for arm in sorted(added.arms):
        total = tallies.total(store, *arm) or arm_sums.none_yet(arm)
        tallies.keep_total(store, added.grown(total))


def _origins(store: Store, plays: Sequence[PlayRow]) -> Mapping[int, int]:
    """The version with which each experiment began."""
    versions = {play.experiment for play in plays if play.experiment is not None}
    found = {one: experiments.by_version(store, one) for one in versions}
    return {one: one if its is None else its.origin for one, its in found.items()}
