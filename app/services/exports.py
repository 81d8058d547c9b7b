"""Exports: NDJSON, line by line, in the form in which it can be imported again."""

import json
from collections.abc import AsyncIterator
from dataclasses import asdict
from functools import partial

from app.domain import Item, ItemModel, ItemMood, ItemSample
from app.services.audits import each_user
from app.storage import items, models, plays
from app.storage.database import Database

PAGE = 1000


async def export_models(database: Database) -> AsyncIterator[str]:
    """The latest version of each model."""
    after = ""
    while some := await database.run(partial(models.page, after=after, limit=PAGE)):
        for model in some:
            yield _line(_model(model))
        after = some[-1].id


async def export_items(database: Database) -> AsyncIterator[str]:
    """All items in order of arrival; retired ones say so."""
    after = -1
    while some := await database.run(partial(items.in_order, after=after)):
        for item in some:
            yield _line(_item(item))
        after = some[-1].serial


async def export_history(database: Database) -> AsyncIterator[str]:
    """All plays that were closed, user by user, in order."""
    async for user in each_user(database):
        after = (-1, 0)
        while some := await database.run(
            partial(plays.history, user=user, after=after, limit=PAGE)
        ):
            for play in some:
                answer = {"signal": play.signal, "at": play.answered_at.isoformat()}
                if play.fraction is not None:
                    answer["fraction"] = play.fraction
                if play.clock:
                    answer["slot"] = play.closed
                if play.closed == after[0]:
                    answer["together"] = True
                yield _line({"user": user, "item": play.item} | answer)
                after = (play.closed, play.place)


def _line(plain: object) -> str:
    return json.dumps(plain, ensure_ascii=False) + "\n"


def _model(model: ItemModel) -> dict[str, object]:
    return {
        "id": model.id,
        "states": model.states,
        "play": model.play,
        "rest": model.rest,
        **_answers(model),
        "prior": model.prior,
        **_samples(model),
        "source": model.source,
    }


def _answers(model: ItemModel) -> dict[str, object]:
    """How its plays are answered: by likes, or by signals of its own."""
    signals, mood = model.signals, model.mood
    moody: dict[str, object] = {} if mood is None else {"mood": _mood(mood)}
    if signals is None:
        return moody or {"like": model.like}
    shares = {} if signals.fractions is None else {"fractions": signals.fractions}
    return {
        "signals": signals.names,
        **(moody or {"observe": signals.observe}),
        "reward": signals.reward,
        **shares,
    }


def _samples(model: ItemModel) -> dict[str, object]:
    if model.samples is None:
        return {}
    return {"samples": [_sample(sample, model) for sample in model.samples]}


def _sample(sample: ItemSample, model: ItemModel) -> dict[str, object]:
    told = {"like": sample.like, "observe": sample.observe}
    given = {name: value for name, value in told.items() if value is not None}
    return {
        "play": sample.play,
        "rest": sample.rest,
        "prior": sample.prior,
        **(given if model.mood is None else {"mood": given}),
    }


def _mood(mood: ItemMood) -> dict[str, object]:
    told = {"like": mood.like, "observe": mood.observe, "shares": mood.shares}
    given = {name: value for name, value in told.items() if value is not None}
    return asdict(mood.rule) | given


def _item(item: Item) -> dict[str, object]:
    described: dict[str, object] = {
        "id": item.id,
        "model": item.model,
        "title": item.title,
        "tags": item.tags,
        "payload": item.payload,
    }
    return described if item.active else described | {"active": False}
