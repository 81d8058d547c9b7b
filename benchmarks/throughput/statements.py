"""The yardstick's tables and statements, which both of its databases share."""

from typing import NamedTuple

import numpy as np

TABLES = (
    """CREATE TABLE users (
    id TEXT PRIMARY KEY, slot INT, pending {uuid}, version INT, seen {time})""",
    "CREATE TABLE beliefs (user_id TEXT PRIMARY KEY, packed {bytes})",
    """CREATE TABLE plays (
    user_id TEXT, id {uuid}, item INT, slot INT, seed BIGINT, predicted {float},
    propensity {float}, created {time}, signal TEXT, answered {time},
    PRIMARY KEY (user_id, id))""",
    "CREATE INDEX plays_id ON plays (id)",
    "CREATE UNIQUE INDEX plays_slot ON plays (user_id, slot)",
)
BY_USER = """SELECT u.slot, u.pending, u.version, b.packed, p.item, p.predicted,
    p.propensity FROM (SELECT 1) AS one LEFT JOIN users u ON u.id = {0}
    LEFT JOIN beliefs b ON b.user_id = u.id
    LEFT JOIN plays p ON p.user_id = u.id AND p.id = u.pending"""
BY_PLAY = """SELECT p.user_id, p.item, u.slot, u.version, b.packed FROM plays p
    JOIN users u ON u.id = p.user_id LEFT JOIN beliefs b ON b.user_id = u.id
    WHERE p.id = {0}"""
MOVE = """INSERT INTO users VALUES ({0}, {1}, {2}, {3}, {4})
    ON CONFLICT (id) DO UPDATE SET slot = excluded.slot, pending = excluded.pending,
    version = excluded.version, seen = excluded.seen
    WHERE users.version = excluded.version - 1"""
ENTER = """INSERT INTO plays VALUES
    ({0}, {1}, {2}, {3}, {4}, {5}, {6}, {7}, NULL, NULL)"""
CLOSE = "UPDATE plays SET signal = {0}, answered = {1} WHERE user_id = {2} AND id = {3}"
KEEP = """INSERT INTO beliefs VALUES ({0}, {1})
    ON CONFLICT (user_id) DO UPDATE SET packed = excluded.packed"""
ENTRY = np.dtype([("item", "<i8"), ("slot", "<i8"), ("belief", "<f8", 4)])


class Standing(NamedTuple):
    """Where a user stands; version 0: nobody has heard of them."""

    slot: int
    pending: str | None
    version: int
    packed: bytes
    item: int
    predicted: float
    propensity: float


class Asked(NamedTuple):
    """A play that was answered, and where its user stands."""

    user: str
    item: int
    slot: int
    version: int
    packed: bytes


class Offered(NamedTuple):
    """A play to enter."""

    user: str
    play: str
    item: int
    slot: int
    seed: int
    predicted: float
    propensity: float


class Taken(NamedTuple):
    """An answer to enter."""

    user: str
    play: str
    signal: str
    packed: bytes
