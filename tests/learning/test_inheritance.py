"""What items without plays are taken for."""

import numpy as np

from learning.inheritance import inherit
from learning.mixture import Types
from tests.learning.logs import chain

ARMS = ("calm 1", "calm 2", "loud 1", "loud 2", "loud 3", "thin", "never")
BELONGS = np.array(
    [[0.9, 0.1], [0.99, 0.01], *[[0.02, 0.98]] * 3, [0.45, 0.55], [0.4, 0.6]]
)
TYPES = Types([chain(1), chain(2)], np.array([0.4, 0.6]), BELONGS)
SEEN = np.arange(6)


def kinds(items: dict[str, tuple[str, ...]]) -> list[int]:
    known = {"calm 1": ("calm",), "calm 2": ("calm", "any")}
    known |= {f"loud {n}": ("loud", "any") for n in (1, 2, 3)}
    found = inherit(TYPES, ARMS, SEEN, known | items)
    assert len(found.kind) == len(found.played) == len(found.tag) == 5 + len(items)
    kind: list[int] = found.kind[5:].tolist()
    return kind


def test_new_items_take_after_the_tag_that_tells_most() -> None:
    assert kinds({"a": ("calm",), "b": ("loud",), "c": ("any", "calm")}) == [0, 1, 0]


def test_without_a_tag_that_is_known_items_are_of_the_usual_type() -> None:
    assert kinds({"a": (), "never": ("new",), "b": ("unheard of",)}) == [1, 1, 1]


def test_what_is_thin_takes_after_its_tag_and_what_is_not_does_not() -> None:
    assert kinds({"thin": ("calm",)}) == [0]
    assert kinds({"thin": ()}) == [1]
    tagged = dict.fromkeys(("calm 1", "calm 2", "loud 1"), ("calm",))
    assert inherit(TYPES, ARMS, SEEN, tagged).kind.tolist() == [0, 0, 1]


def test_tagged_with_a_group_an_item_follows_the_group() -> None:
    found = inherit(TYPES, ARMS, SEEN, {"song": ("calm 2",), "calm 2": ()})

    assert found.kind.tolist() == [0, 0]
    assert found.played == [False, True]
    assert found.tag == ["calm 2", None]


def test_an_item_does_not_take_after_itself() -> None:
    """Alone with its tag, a thin arm is what its own plays say."""
    [alone] = inherit(TYPES, ARMS, SEEN, {"thin": ("its own",)}).kind.tolist()
    [bare] = inherit(TYPES, ARMS, SEEN, {"thin": ()}).kind.tolist()

    assert alone == bare == 1
