"""Checks now and then that models predict as they should, and tells what it finds."""

from datetime import UTC, datetime, timedelta
from functools import partial

import structlog

from app import metrics
from app.services import guard, guard_scores
from app.services.guard import Checked
from app.services.guard_fallback import Fallback
from app.services.rounds import Rounds
from app.storage import judgements
from app.storage.database import Database
from app.storage.judgements import Judgement, State

EVERY = 60.0  # seconds between checks, of whatever process

logger = structlog.get_logger()


class GuardWatch:
    """Has its turn again and again, until it is stopped."""

    def __init__(self, database: Database, fallback: Fallback | None) -> None:
        self._database = database
        self._fallback = fallback
        self._shown: set[str] = set()
        self._rounds = Rounds(self._turn, EVERY, "the guard is delayed")
        self.stop = self._rounds.stop
        self.run = self._rounds.run

    async def _turn(self) -> None:
        """Check if no other process just did; show what is known in any case."""
        every = timedelta(seconds=0.9 * EVERY)
        due = partial(guard.is_due, now=datetime.now(UTC), every=every)
        more = await self._database.run(due)
        while more and not self._rounds.is_stopping:
            check = partial(guard.check, now=datetime.now(UTC), fallback=self._fallback)
            checked = await self._database.run(check)
            _tell(checked)
            more = checked.more
        self._show({one.model: one for one in await self._judgements()})

    async def _judgements(self) -> "list[Judgement]":
        return list(await self._database.run(judgements.every))

    def _show(self, judged: dict[str, Judgement]) -> None:
        """Set the gauges; a model that is gone is in no alarm."""
        for model in self._shown - judged.keys():
            metrics.GUARD_ALARM.labels(model).set(0)
        for model, judgement in judged.items():
            _show(model, judgement)
        self._shown = set(judged)


def _show(model: str, judgement: Judgement) -> None:
    metrics.GUARD_ALARM.labels(model).set(judgement.state is State.ALARM)
    if judgement.scores is None:
        return
    scores = guard_scores.of(judgement.scores)
    metrics.GUARD_CALIBRATION.labels(model).set(scores.calibration)
    for predictor in ("model", "constant", "rate"):
        loss = getattr(scores, predictor)
        metrics.GUARD_LOSS.labels(model, predictor).set(loss)


def _tell(checked: Checked) -> None:
    """A line for each change."""
    for judgement in checked.changed:
        scores = judgement.scores or {}
        logger.warning(
            "the guard changes its mind",
            model=judgement.model,
            version=judgement.version,
            state=judgement.state.value,
            excess=scores.get("excess"),
            error=scores.get("error"),
        )
    if checked.replaced is not None:
        if checked.replaced.is_fallback:
            metrics.GUARD_FALLS.inc()
        logger.warning(
            "the guard replaces the policy",
            policy=checked.replaced.name,
            version=checked.replaced.version,
            note=checked.replaced.note,
        )
