"""All that reads bytes or texts of others: what it takes, and how it refuses."""

import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from pydantic import ValidationError

from app.api.schemas import lines, pages
from app.errors import InvalidCursor, UnusableModel
from app.services import new_models
from app.services.formats import Format
from app.services.lines import Layout, LineFile
from app.services.policy_catalogue import complete
from app.settings import Settings
from app.storage import index_packing, packing
from app.storage.packing import Entries, Felt, UnknownFormat
from learning.reading import InvalidLog, read, read_spotify
from policies import POLICIES
from simulation.examples import DATA
from tests.catalogues import SERIES, SIMPLE

ITEM = {"id": "a", "model": "pop", "title": "A", "tags": ["calm"], "payload": {"u": 1}}
PLAY = {"user": "ann", "item": "a", "signal": "like", "at": "2026-03-01T20:15:00Z"}
LOG = [
    {"user": "ann", "item": "a", "time": "2026-03-01T20:15:00Z", "like": 1},
    {"user": "bob", "item": "b", "time": "2026-03-01T20:19:00Z", "like": 0},
]
EXPORT = {
    "endTime": "2024-01-05 12:30",
    "artistName": "A",
    "trackName": "B",
    "msPlayed": 180_000,
}


@dataclass(frozen=True, slots=True)
class Decoder:
    """Something that reads bytes.

    seeds:   that it reads
    read:    raises one of `refuses`, or nothing
    refuses: how it says no
    """

    seeds: Sequence[bytes]
    read: Callable[[bytes, Path], object]
    refuses: tuple[type[Exception], ...]


def _json(*plain: object) -> bytes:
    return b"\n".join(json.dumps(each).encode() for each in plain)


def _imported(
    text: bytes,
    _folder: Path,
    *,
    kind: Format,
    layout: Layout[Any],
    models: bool = False,
) -> None:
    file = LineFile(io.BytesIO(text), kind, layout)
    faults = file.faults()
    for _, entry in file.entries(faults):
        if models:
            try:
                new_models.check(entry)
            except UnusableModel:
                faults.total += 1


def _entries() -> Entries:
    felt = Felt(3, 1_700_000_000_000_000, 2, 1, 0.5, resumed=True)
    beliefs = np.full((3, 2), 0.5)
    return Entries(np.arange(3), np.arange(3) + 1, beliefs, felt)


def _cursor(text: bytes, _folder: Path, decode: Callable[[str], object]) -> None:
    decode(text.decode("latin-1"))


def _log(text: bytes, folder: Path, name: str) -> None:
    file = folder / name
    file.write_bytes(text)
    read([file])


def _spotify(text: bytes, folder: Path) -> None:
    person = folder / "person"
    person.mkdir(exist_ok=True)
    (person / "StreamingHistory_music_0.json").write_bytes(text)
    read_spotify([person])


def _policy(text: bytes, _folder: Path) -> None:
    try:
        told = json.loads(text)
    except (ValueError, RecursionError):
        return
    if isinstance(told, dict):
        for name in POLICIES:
            try:
                complete(name, told)
            except ValueError:
                continue


def _settings(text: bytes, _folder: Path) -> None:
    given = text.decode("latin-1")
    for name in Settings.model_fields:
        try:
            Settings.model_validate({name: given})
        except ValidationError:
            continue


def _parquet() -> bytes:
    file = io.BytesIO()
    pl.DataFrame(LOG).write_parquet(file)
    return file.getvalue()


EXAMPLE = (DATA / "example-2.json").read_bytes()
MODELS_SEEDS = [
    _json({"id": "pop", **SIMPLE}),
    _json({"id": "s", **SERIES}),
    _json({"id": "p", **SIMPLE, "samples": [
        {name: SIMPLE[name] for name in ("play", "rest", "prior", "like")}
    ]}),
]  # fmt: skip
CSV_ITEMS = b"id,model,title,tags,payload,active\na,pop,A,calm;x,{},true\n"
YAML = (
    b"- id: a\n  model: pop\n  tags: [calm, x]\n  payload: &p {u: 1}\n"
    b"- {id: b, model: pop, payload: *p}\n"
)
POLICY = _json({"name": "rollout", "params": {"base": "myopic", "horizon": 5}})
imported = partial(partial, _imported)
DECODERS: Mapping[str, Decoder] = {
    "beliefs": Decoder(
        [packing.pack(_entries())],
        lambda text, _: packing.unpack(text, 3),
        (UnknownFormat,),
    ),
    "index tables": Decoder(
        [index_packing.pack(np.arange(5.0), np.ones((2, 3)))],
        lambda text, _: index_packing.unpack(text),
        (UnknownFormat,),
    ),
    "cursors of texts": Decoder(
        [(pages.encode("item-7") or "").encode()],
        partial(_cursor, decode=pages.decode_text),
        (InvalidCursor,),
    ),
    "cursors of numbers": Decoder(
        [(pages.encode(7) or "").encode()],
        partial(_cursor, decode=partial(pages.decode_number, first=0)),
        (InvalidCursor,),
    ),
    "cursors of pairs": Decoder(
        [(pages.encode((7, 1)) or "").encode()],
        partial(_cursor, decode=partial(pages.decode_pair, first=(0, 0))),
        (InvalidCursor,),
    ),
    "items, NDJSON": Decoder(
        [_json(ITEM, ITEM)], imported(kind=Format.NDJSON, layout=lines.ITEMS), ()
    ),
    "items, CSV": Decoder(
        [CSV_ITEMS], imported(kind=Format.CSV, layout=lines.ITEMS), ()
    ),
    "items, YAML": Decoder([YAML], imported(kind=Format.YAML, layout=lines.ITEMS), ()),
    "models, NDJSON": Decoder(
        MODELS_SEEDS,
        imported(kind=Format.NDJSON, layout=lines.MODELS, models=True),
        (),
    ),
    "models, JSON": Decoder(
        [EXAMPLE], imported(kind=Format.JSON, layout=lines.MODELS, models=True), ()
    ),
    "models, YAML": Decoder(
        [EXAMPLE], imported(kind=Format.YAML, layout=lines.MODELS, models=True), ()
    ),
    "history, NDJSON": Decoder(
        [_json(PLAY, {**PLAY, "together": True, "slot": 3})],
        imported(kind=Format.NDJSON, layout=lines.HISTORY),
        (),
    ),
    "history, CSV": Decoder(
        [b"user,item,signal,at\nann,a,like,2026-03-01T20:15:00Z\n"],
        imported(kind=Format.CSV, layout=lines.HISTORY),
        (),
    ),
    "policies, YAML": Decoder(
        [POLICY, b"- name: myopic\n- {name: epsilon, params: {epsilon: 0.1}}\n"],
        imported(kind=Format.YAML, layout=lines.POLICIES),
        (),
    ),
    "logs, CSV": Decoder(
        [b"user,item,time,like\nann,a,2026-03-01T20:15:00Z,1\nbob,b,2026-03-02,0\n"],
        partial(_log, name="log.csv"),
        (InvalidLog,),
    ),
    "logs, NDJSON": Decoder(
        [_json(*LOG)], partial(_log, name="log.ndjson"), (InvalidLog,)
    ),
    "logs, Parquet": Decoder(
        [_parquet()], partial(_log, name="log.parquet"), (InvalidLog,)
    ),
    "Spotify's exports": Decoder([_json([EXPORT, EXPORT])], _spotify, (InvalidLog,)),
    "parameters of policies": Decoder(
        [
            _json({"base": ["myopic", "whittle"], "horizon": 3, "discount": 0.9}),
            _json({"policy": {"name": "thompson", "params": {}}, "epsilon": 0.1}),
        ],
        _policy,
        (),
    ),
    "settings": Decoder(
        [b"sqlite:///encore.db", b"postgresql://u:p@h:1/d", b"30", b'{"name": "x"}'],
        _settings,
        (),
    ),
}
