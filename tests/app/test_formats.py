"""YAML means what JSON means, and no more."""

import json
from io import BytesIO

import pytest

from app.errors import Fault
from app.services.formats import Format, records

BOMB = "a: &a0 [x]\n" + "".join(
    f"b{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 9)
)
DEEP = "a0: &a0 x\n" + "".join(
    f"a{n}: &a{n} {'[' * 20}*a{n - 1}{']' * 20}\n" for n in range(1, 7)
)


def read(text: str) -> list[object]:
    found = records(BytesIO(text.encode()), Format.YAML, {})
    return [record for _, record in found]


def test_json_is_yaml() -> None:
    record = {"a": [1, -0.25, 1e-3, True, None, "x"], "b": {"c": []}, "é": "\n"}

    assert read(json.dumps([record, record])) == [record, record]


def test_plain_texts_stay_texts() -> None:
    plain = "[no, on, yes, 1:30, 2026-11-01, 010, 0x1F, 1_000, <<, =, 1e]"

    [record] = read(f"a: {plain}")

    assert record == {"a": plain.strip("[]").split(", ")}


def test_what_is_said_once_can_be_repeated() -> None:
    [record] = read("a: &rest [[0.5, 0.5], &row [1, 0]]\nb: *rest\nc: *row")

    assert record == {"a": [[0.5, 0.5], [1, 0]], "b": [[0.5, 0.5], [1, 0]], "c": [1, 0]}


def test_numbers_are_numbers() -> None:
    [record] = read("a: [0, -7, +7, 1., .5, 1e3, -2.5E-1, .inf, true, ~, ]")

    assert record == {"a": [0, -7, 7, 1.0, 0.5, 1e3, -0.25, float("inf"), True, None]}


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("a: &x [*x]", "has the alias *x of nothing before it"),
        ("a: *x", "has the alias *x of nothing before it"),
        (DEEP, "is nested too deeply"),
        (BOMB, "stands for more than 1000000 values"),
        ("[" * 101 + "]" * 101, "is nested too deeply"),
        ("[" * 100_000 + "]" * 100_000, "is nested too deeply"),
        ("a: [", "is no YAML: did not find expected node content in line "),
        ("a: 1\n b: 2", "is no YAML: mapping values are not allowed in this context"),
        ("a: !!timestamp 2020-01-01", "has the tag tag:yaml.org,2002:timestamp, which"),
        ("a: !!float '1:30'", "has the tag tag:yaml.org,2002:float, which is not"),
        ("a: !!bool x", "has the tag tag:yaml.org,2002:bool, which is not taken"),
        ("!!python/object:os.system x", "has the tag tag:yaml.org,2002:python/object"),
        ("a: !!binary [x]", "is no YAML: "),
        ("a: [{1: x, true: y}]", "has the key 1, which is no text: put it in quotes"),
        ("? [a]\n: 1", "is no YAML: found unhashable key in line 1"),
        ("a: 1\n---\nb: 2", "is no YAML: but found another document in line 2"),
        ("a: \x00", "is no YAML: unacceptable character #x0000"),
        ("a: " + "1" * 5000, "is no YAML: Exceeds the limit"),
        ("just a text", "is no object"),
        ("", "is no object"),
    ],
)
def test_what_is_more_than_json_or_nothing_is_refused(
    text: str, complaint: str
) -> None:
    [fault] = read(text)

    assert isinstance(fault, Fault)
    assert fault.message.startswith(complaint)
