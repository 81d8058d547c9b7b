"""Items without plays, or with few, take after others of a tag.

How far the seen arms of a tag are of each type says what else has the tag. Of several
tags, the one counts whose arms differ most from all others. The name of an arm is a tag
of its own: what is tagged with a group that was learned as one arm follows the group.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from learning.mixture import Types
from policies import Floats, Ints

STRENGTH = 0.5  # of an arm like all others, beside those of a tag
TINY = 1e-300


@dataclass(frozen=True, slots=True, eq=False)
class Inherited:
    """What items are taken for.

    Attributes:
        kind: (I,) the likeliest type of each item.
        played: (I,) whether plays of its own speak for it.
        tag: of each item, that which speaks for it; None: it has none that is known.
    """

    kind: Ints
    played: Sequence[bool]
    tag: Sequence[str | None]


def inherit(
    types: Types, arms: Sequence[str], seen: Ints, items: Mapping[str, Sequence[str]]
) -> Inherited:
    """Say which type items are of.

    Args:
        types: of A arms.
        arms: A names.
        seen: rows of the arms that were played.
        items: I names, with the tags of each.
    """
    known = {arms[row]: row for row in seen.tolist()}
    row = np.array([known.get(name, -1) for name in items], dtype=np.int64)
    kin = _Kin.of(types, known, items)
    prior, tag = kin.priors(row, items)
    own = np.where(row[:, None] >= 0, types.belongs[row] / types.share, 1.0)
    kind = np.asarray((own * prior).argmax(axis=1), dtype=np.int64)
    return Inherited(kind, (row >= 0).tolist(), tag)


@dataclass(frozen=True, slots=True, eq=False)
class _Kin:
    """Seen arms by tag.

    Attributes:
        number: of each tag.
        belongs: (A, K) of arms.
        share: (K,) of all arms.
        sums: (T, K) of `belongs`, over the arms of a tag.
        counts: (T,) of these arms.
    """

    number: Mapping[str, int]
    belongs: Floats
    share: Floats
    sums: Floats
    counts: Ints

    @classmethod
    def of(
        cls, types: Types, known: Mapping[str, int], items: Mapping[str, Sequence[str]]
    ) -> "_Kin":
        """Gather arms by their own names, and by their tags."""
        pairs = {(name, row) for name, row in known.items()}
        for item, tags in items.items():
            if item in known:
                pairs.update((tag, known[item]) for tag in tags)
        number: dict[str, int] = {}
        ordered = sorted(pairs)
        tag = [number.setdefault(name, len(number)) for name, _ in ordered]
        sums = np.zeros((len(number), len(types.share)))
        np.add.at(sums, tag, types.belongs[[row for _, row in ordered]])
        counts = np.bincount(tag, minlength=1)
        return cls(number, types.belongs, types.share, sums, counts)

    def priors(
        self, row: Ints, items: Mapping[str, Sequence[str]]
    ) -> tuple[Floats, Sequence[str | None]]:
        """Return (I, K) by the most telling tag of each item, and which that is.

        An arm does not take after itself.
        """
        named = [[n for n in tags if n in self.number] for tags in items.values()]
        names = [*chain(*named)]
        item = np.repeat(np.arange(len(items)), [len(each) for each in named])
        shares = self._shares([self.number[name] for name in names], row[item])
        telling = (shares * np.log(shares / self.share)).sum(axis=1)
        prior = np.tile(self.share, (len(items), 1))
        of: list[str | None] = [None] * len(items)
        for pair in np.lexsort((telling, item)).tolist():  # the most telling comes last
            prior[item[pair]], of[item[pair]] = shares[pair], names[pair]
        return prior, of

    def _shares(self, tag: Sequence[int], arm: Ints) -> Floats:
        """Return (P, K): of the arms of each tag, but for one; -1: for none."""
        rows, itself = np.array(tag, dtype=np.int64), arm >= 0
        left = np.where(itself[:, None], self.belongs[arm], 0.0)
        arms = np.asarray(self.counts[rows] - itself + STRENGTH)
        sums = self.sums[rows] - left + STRENGTH * self.share
        return np.maximum(sums / arms[:, None], TINY)
