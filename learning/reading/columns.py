"""Which column of a log says what."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from learning.reading.faults import Fault, InvalidLog

Unit: TypeAlias = Literal["milliseconds", "seconds", "minutes"]

KNOWN: Mapping[str, Sequence[str]] = {
    "user": ("user", "user_id"),
    "arm": (
        *("arm", "item", "item_id", "group"),
        *("artist", "artist_id", "track", "track_id"),
    ),
    "time": ("time", "timestamp", "datetime", "at", "ts", "played_at"),
    "order": ("order", "seq", "sequence", "slot"),
    "signal": ("signal",),
    "fraction": ("fraction",),
    "like": ("like", "liked"),
    "propensity": ("propensity",),
}
ANSWERS = ("signal", "fraction", "like")
NEEDED = (("user",), ("arm",), ("time", "order"), ANSWERS)
GROUPS = (*NEEDED, ("propensity",))  # of which none is looked for if one is given
CANDIDATES = tuple(name for names in KNOWN.values() for name in names)


@dataclass(frozen=True, slots=True)
class Columns:
    """Names of columns; None: found by its name, or left out.

    Attributes:
        user: who was played to.
        arm: what was played: an item, or the group that it plays and rests with.
        time: when the play began: a moment, as ISO 8601 text or of a type for moments,
            without a zone in UTC; or a number of a `unit`.
        order: a whole number that ascends with each user's plays. It goes before the
            time: see `read`.
        signal: name of the answer, "none" or empty if there was none.
        fraction: share that was played, empty if there is no answer. It counts where
            there is no signal.
        like: whether it was liked: 0, 1, true, false, or empty.
        propensity: chance with which the arm was chosen, above 0; empty: not known.
        unit: of times that are numbers.

    If one of time and order is given, the other is not looked for; nor are other
    answers if one is given.
    """

    user: str | None = None
    arm: str | None = None
    time: str | None = None
    order: str | None = None
    signal: str | None = None
    fraction: str | None = None
    like: str | None = None
    propensity: str | None = None
    unit: Unit | None = None

    @property
    def given(self) -> Mapping[str, str]:
        """Return names by what they say."""
        pairs = ((role, getattr(self, role)) for role in KNOWN)
        return {role: name for role, name in pairs if name is not None}

    def found(self, names: Collection[str]) -> "Columns":
        """Return all the columns of a log that has those names.

        Raises:
            InvalidLog: if one cannot be told; it says what to give.
        """
        faults = list(_faults(self, names))
        told = dict(self.given)
        for roles in GROUPS:
            if not told.keys() & set(roles):
                told |= _looked_for(roles, names, faults)
        if "like" in told and len(told.keys() & set(ANSWERS)) > 1:
            rivals = " and ".join(repr(told[role]) for role in ANSWERS if role in told)
            message = f"{rivals} could each be the answer: give the one that is"
            faults.append(Fault("", None, None, message))
        if faults:
            raise InvalidLog(faults)
        return Columns(
            user=told.get("user"),
            arm=told.get("arm"),
            time=told.get("time"),
            order=told.get("order"),
            signal=told.get("signal"),
            fraction=told.get("fraction"),
            like=told.get("like"),
            propensity=told.get("propensity"),
            unit=self.unit,
        )


def _faults(columns: Columns, names: Collection[str]) -> Iterator[Fault]:
    """What is wrong with what was given."""
    for name in columns.given.values():
        if name not in names:
            yield Fault("", None, name, f"is no column; {_listed(names)}")
    if columns.unit is not None and columns.order and not columns.time:
        yield Fault("", None, columns.order, "is an order: that has no unit")


def _looked_for(
    roles: Sequence[str], names: Collection[str], faults: list[Fault]
) -> Mapping[str, str]:
    """What says one of some things, by its name."""
    found: dict[str, str] = {}
    for role in roles:
        named = [name for name in KNOWN[role] if name in names]
        if len(named) > 1:
            either = " and ".join(map(repr, named))
            message = f"{either} could each be the {role}: give one as {role}"
            faults.append(Fault("", None, None, message))
        if named:
            found[role] = named[0]
    if not found and roles in NEEDED:
        either = " or ".join(roles)
        message = f"no column is known as {either}: give its name; {_listed(names)}"
        faults.append(Fault("", None, None, message))
    return found


def _listed(names: Collection[str]) -> str:
    return f"there are {', '.join(names)}" if names else "there is none"
