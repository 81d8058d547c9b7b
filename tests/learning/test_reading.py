"""Logs of columns: what is written is read, and what is wrong is named."""

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from learning import NONE
from learning.reading import Columns, Fault, InvalidLog, Scale, Unit, read
from tests.learning.written import Row, write

FORMATS = ("log.csv", "log.csv.gz", "log.ndjson", "log.jsonl.gz", "log.parquet")
SIGNALS = ("none", "skip", "like")
NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=6)
MOMENTS = st.datetimes(datetime(1971, 1, 1), datetime(2100, 1, 1))  # noqa: DTZ001
PLAIN: Row = {"user": "ann", "item": "a", "order": 1, "like": 1}


@st.composite
def logs(draw: st.DrawFn) -> list[Row]:
    names = draw(st.lists(NAMES, min_size=1, max_size=4))
    row = st.fixed_dictionaries(
        {
            "user": st.sampled_from(names),
            "item": st.sampled_from(names),
            "at": MOMENTS.map(lambda moment: moment.replace(tzinfo=UTC)),
            "order": st.integers(-(2**63), 2**63 - 1),
            "signal": st.sampled_from([None, *SIGNALS]),
            "propensity": st.none() | st.floats(0, 1, exclude_min=True),
        }
    )
    rows = draw(st.lists(row, min_size=1, max_size=30))
    rows[0]["signal"] = "like"  # an NDJSON without any value has not the column
    left_out = draw(st.sampled_from([(), ("at",), ("order",), ("propensity",)]))
    return [
        {name: cell for name, cell in row.items() if name not in left_out}
        for row in rows
    ]


def expected(rows: Sequence[Row]) -> list[Row]:
    """The plays in their order, by the obvious way."""
    by = "order" if "order" in rows[0] else "at"
    return sorted(rows, key=lambda row: (row["user"], row[by]))


def expected_seconds(ordered: Sequence[Row]) -> list[float]:
    latest: dict[object, float] = {}
    seconds = []
    for row in ordered:
        at = row["at"]
        assert isinstance(at, datetime)
        before = latest.get(row["user"], -np.inf)
        latest[row["user"]] = max(at.timestamp(), before)
        seconds.append(latest[row["user"]])
    return seconds


def faults(
    files: Sequence[Path], columns: Columns | None = None, scale: Scale | None = None
) -> InvalidLog:
    with pytest.raises(InvalidLog) as refused:
        read(files, columns or Columns(), scale or Scale())
    return refused.value


def said(error: InvalidLog) -> list[tuple[int | None, str | None, str]]:
    return [(fault.row, fault.column, fault.message) for fault in error.faults]


@settings(max_examples=150, deadline=None)
@given(logs(), st.sampled_from(FORMATS), st.integers(0, 30))
def test_what_is_written_is_read(rows: list[Row], name: str, cut: int) -> None:
    with TemporaryDirectory() as folder:
        for number, part in enumerate((rows[:cut], rows[cut:])):
            if part:
                write(Path(folder, f"{number}-{name}"), part)

        plays = read([Path(folder)])

    ordered = expected(rows)
    assert list(plays.users) == sorted({str(row["user"]) for row in rows})
    assert list(plays.arms) == sorted({str(row["item"]) for row in rows})
    assert [plays.users[user] for user in plays.user] == [r["user"] for r in ordered]
    assert [plays.arms[arm] for arm in plays.arm] == [r["item"] for r in ordered]
    assert [SIGNALS[answer + 1] for answer in plays.answer] == [
        row["signal"] or "none" for row in ordered
    ]
    if "at" in rows[0]:
        assert plays.seconds is not None
        assert_allclose(plays.seconds, expected_seconds(ordered), rtol=0, atol=1e-6)
    else:
        assert plays.seconds is None
    if plays.propensity is not None:
        known = [row["propensity"] or np.nan for row in ordered]
        assert_array_equal(plays.propensity, known)
    else:
        assert not any(row.get("propensity") for row in rows)
    assert plays.signals == ("skip", "like")
    assert plays.reward == (0.0, 1.0)


@pytest.mark.parametrize("name", FORMATS)
def test_arrays_are_of_the_types_that_plays_have(tmp_path: Path, name: str) -> None:
    rows = [PLAIN | {"time": "2026-03-01", "propensity": 0.5}] * 3

    plays = read([write(tmp_path / name, rows)])

    assert plays.seconds is not None
    assert plays.propensity is not None
    ints, floats = (plays.user, plays.arm), (plays.seconds, plays.propensity)
    assert {array.dtype for array in ints} == {np.dtype(np.int64)}
    assert {array.dtype for array in floats} == {np.dtype(np.float64)}
    assert plays.answer.dtype == np.int8
    for array in (*ints, *floats, plays.answer):
        assert array.flags.writeable
        assert array.flags.c_contiguous


def test_plays_at_once_stay_in_their_order(tmp_path: Path) -> None:
    number = 5000
    rows = [PLAIN | {"user": n % 3, "item": n, "order": 7} for n in range(number)]

    plays = read([write(tmp_path / "log.csv", rows)])

    read_items = [int(plays.arms[arm]) for arm in plays.arm]
    assert read_items == sorted(range(number), key=lambda n: n % 3)


@pytest.mark.parametrize("name", FORMATS)
def test_the_format_of_a_file_does_not_matter(tmp_path: Path, name: str) -> None:
    """Numbers as names, truths, and numbers that say more than they need."""
    rows: list[Row] = [
        {"user_id": 7, "track": 10, "seq": 2.0, "like": True},
        {"user_id": 7, "track": 9, "seq": 1.0, "like": None},
        {"user_id": 12, "track": 10, "seq": 0.0, "like": False},
    ]

    plays = read([write(tmp_path / name, rows)])

    assert plays.users == ("12", "7")
    assert plays.arms == ("10", "9")
    assert_array_equal(plays.user, [0, 1, 1])
    assert_array_equal(plays.arm, [0, 1, 0])
    assert_array_equal(plays.answer, [0, NONE, 1])
    assert plays.seconds is None
    assert plays.propensity is None


MOMENT = datetime(2026, 3, 1, 20, 15, 7, 250000, UTC).timestamp()


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("2026-03-01T20:15:07.250Z", MOMENT),
        ("2026-03-01T21:15:07.25+01:00", MOMENT),
        ("2026-03-01T14:45:07.250000-0530", MOMENT),
        ("2026-03-01 20:15:07.250000+00:00", MOMENT),
        ("2026-03-01 20:15:07.25", MOMENT),
        ("2026-03-01T20:15:07", MOMENT - 0.25),
        ("2026-03-01T20:15Z", MOMENT - 7.25),
        ("2026-03-01 20:15", MOMENT - 7.25),
        ("2026-03-01", MOMENT - 7.25 - 15 * 60 - 20 * 3600),
        ("1969-12-31T23:59:59.5Z", -0.5),
    ],
)
def test_moments_are_read_as_iso_8601_has_them(
    tmp_path: Path, text: str, seconds: float
) -> None:
    """Also beside moments of another form."""
    rows = [
        PLAIN | {"user": user, "order": n, "time": time}
        for n, (user, time) in enumerate([("a", text), ("b", "2026-03-01T20:15:07Z")])
    ]

    plays = read([write(tmp_path / "log.csv", rows)])

    assert plays.seconds is not None
    assert_array_equal(plays.seconds, [seconds, MOMENT - 0.25])


@pytest.mark.parametrize(
    "time",
    [
        pl.lit(MOMENT * 1000).cast(pl.Datetime("ms")),
        pl.lit(MOMENT * 1e6).cast(pl.Datetime("us", "UTC")),
        pl.lit(MOMENT * 1e6).cast(pl.Datetime("us", "UTC")).dt.cast_time_unit("ns"),
        pl.lit(MOMENT * 1e6)
        .cast(pl.Datetime("us", "UTC"))
        .dt.convert_time_zone("Asia/Kolkata"),
    ],
)
def test_moments_of_a_type_are_read(tmp_path: Path, time: pl.Expr) -> None:
    frame = pl.DataFrame([{"user": "ann", "item": "a", "like": 1}])
    frame.with_columns(time=time).write_parquet(tmp_path / "log.parquet")

    plays = read([tmp_path / "log.parquet"])

    assert plays.seconds is not None
    assert_array_equal(plays.seconds, [MOMENT])


@pytest.mark.parametrize(
    ("unit", "time"),
    [("milliseconds", 90_000), ("seconds", 90.0), ("minutes", 1.5)],
)
@pytest.mark.parametrize("name", FORMATS)
def test_times_may_be_numbers_of_a_unit(
    tmp_path: Path, name: str, unit: Unit, time: float
) -> None:
    file = write(tmp_path / name, [PLAIN | {"time": time}])

    plays = read([file], Columns(time="time", unit=unit))

    assert plays.seconds is not None
    assert_array_equal(plays.seconds, [90])
    [fault] = faults([file], Columns(time="time")).faults
    assert "give the" in fault.message or "give their" in fault.message


def test_order_rules_and_times_are_raised_to_it(tmp_path: Path) -> None:
    rows = [
        PLAIN | {"user": user, "item": order, "order": order, "time": time}
        for user, order, time in [
            ("bob", 3, 4.0),
            ("ann", 2, 9.0),
            ("bob", 1, 5.0),
            ("ann", 3, 7.0),
            ("ann", 1, 8.0),
            ("bob", 2, 1.0),
        ]
    ]
    file = write(tmp_path / "log.ndjson", rows)

    plays = read([file], Columns(unit="seconds"))
    by_time = read([file], Columns(time="time", unit="seconds"))

    assert plays.seconds is not None
    assert by_time.seconds is not None
    assert [plays.arms[arm] for arm in plays.arm] == ["1", "2", "3"] * 2
    assert_array_equal(plays.seconds, [8, 9, 9, 5, 5, 5])
    assert [by_time.arms[arm] for arm in by_time.arm] == ["3", "1", "2", "2", "3", "1"]
    assert_array_equal(by_time.seconds, [7, 8, 9, 1, 4, 5])


def answers(file: Path, scale: Scale | None = None) -> list[int]:
    return [int(answer) for answer in read([file], scale=scale or Scale()).answer]


def test_a_share_played_means_the_signal_that_it_reaches(tmp_path: Path) -> None:
    shares = [0, 0.3, 0.79, 0.8, 1, 1.4, 10, None]
    rows: list[Row] = [
        {"user": "ann", "item": "a", "order": n, "fraction": share}
        for n, share in enumerate(shares)
    ]
    file = write(tmp_path / "log.csv", rows)
    scale = Scale(("love", "leave", "stay"), (1, 0, 0.5), {"leave": 0, "love": 0.9})

    assert answers(file) == [0, 0, 0, 1, 1, 1, 1, NONE]
    assert answers(file, Scale(fractions={"skip": 0, "like": 0.3}))[:2] == [0, 1]
    assert answers(file, scale) == [1, 1, 1, 1, 0, 0, 0, NONE]


def test_a_signal_counts_before_a_share(tmp_path: Path) -> None:
    told = [("skip", 1), (None, 1), ("none", 0.1), (None, None), ("like", None)]
    rows: list[Row] = [
        {"user": "ann", "item": "a", "order": n, "signal": signal, "fraction": share}
        for n, (signal, share) in enumerate(told)
    ]

    assert answers(write(tmp_path / "log.ndjson", rows)) == [0, 1, NONE, NONE, 1]


def test_signals_may_be_of_ones_own(tmp_path: Path) -> None:
    rows = [
        {"user": "ann", "item": "a", "order": n, "signal": signal}
        for n, signal in enumerate(["heart", "none", "left", "stayed"])
    ]
    scale = Scale(("left", "stayed", "heart"), (0, 0.4, 1), None)

    plays = read([write(tmp_path / "log.parquet", rows)], scale=scale)

    assert_array_equal(plays.answer, [2, NONE, 0, 1])
    assert plays.signals == ("left", "stayed", "heart")
    assert plays.reward == (0, 0.4, 1)


@pytest.mark.parametrize(
    ("signals", "reward", "fractions"),
    [
        (("skip", "none"), (0, 1), None),
        (("skip", "skip"), (0, 1), None),
        (("skip", "like"), (0, 0.5, 1), None),
        (("skip", "like"), (0, 1), {"love": 0}),
        (("skip", "like"), (0, 1), {"like": 0.8}),
        (("skip", "like"), (0, 1), {"skip": 0, "like": 0}),
    ],
)
def test_a_scale_that_is_none_is_refused(
    signals: tuple[str, ...],
    reward: tuple[float, ...],
    fractions: Mapping[str, float] | None,
) -> None:
    with pytest.raises(ValueError, match="must"):
        Scale(signals, reward, fractions)


@pytest.mark.parametrize(
    ("log", "columns", "complaint"),
    [
        (
            {"user": 1, "artist": 1, "track": 1, "seq": 1, "like": 1},
            Columns(),
            "'artist' and 'track' could each be the arm: give one as arm",
        ),
        (
            {"user": 1, "item": 1, "time": "2026-01-01", "ts": 1, "like": 1},
            Columns(),
            "'time' and 'ts' could each be the time: give one as time",
        ),
        (
            {"user": 1, "item": 1, "seq": 1, "like": 1, "signal": "like"},
            Columns(),
            "'signal' and 'like' could each be the answer: give the one that is",
        ),
        (
            {"User": 1, "item": 1, "seq": 1, "like": 1},
            Columns(),
            "no column is known as user: give its name; there are ",
        ),
        (
            {"user": 1, "item": 1, "like": 1},
            Columns(),
            "no column is known as time or order: give its name; there are ",
        ),
        (
            {"user": 1, "item": 1, "seq": 1},
            Columns(),
            "no column is known as signal or fraction or like: give its name; there ",
        ),
        (dict(PLAIN), Columns(arm="song"), "song: is no column; there are "),
        (
            dict(PLAIN),
            Columns(order="order", unit="seconds"),
            "order: is an order: that has no unit",
        ),
    ],
)
@pytest.mark.parametrize("name", FORMATS)
def test_columns_that_cannot_be_told_are_asked_for(
    tmp_path: Path, name: str, log: Row, columns: Columns, complaint: str
) -> None:
    [fault] = faults([write(tmp_path / name, [log])], columns).faults

    assert str(fault).startswith(complaint)


def test_a_given_column_ends_the_doubt(tmp_path: Path) -> None:
    sure = {"user": 1, "track": 3, "seq": 4, "like": 1}
    log = sure | {"artist": 2, "ts": "2026-01-01", "time": "", "signal": "x"}
    columns = Columns(arm="track", order="seq", like="like")

    plays = read([write(tmp_path / "log.csv", [log])], columns)

    assert plays.arms == ("3",)
    assert plays.seconds is None


@pytest.mark.parametrize("name", FORMATS)
def test_what_is_wrong_is_told_by_row(tmp_path: Path, name: str) -> None:
    good = PLAIN | {"order": "1", "like": "1", "time": "2026-03-01", "propensity": "1"}
    file = write(
        tmp_path / name,
        [
            good,
            good | {"user": None, "item": ""},
            good | {"order": "one", "like": "2"},
            good | {"time": "2026-02-30", "propensity": "0"},
            good | {"order": "1.5", "time": None, "propensity": "NaN"},
            good | {"order": "inf", "like": "none", "propensity": "1.1"},
            good,
        ],
    )

    error = faults([file])

    moment = "is no moment like 2026-03-01T20:15:00Z; if it is a number, give the unit"
    whole, chance = "is no whole number of 64 bits", "is no chance above 0, up to 1"
    assert said(error) == [
        (2, "user", "is missing"),
        (2, "item", "is missing"),
        (3, "order", f"'one' {whole}"),
        (3, "like", "'2' is neither 0 nor 1"),
        (4, "time", f"'2026-02-30' {moment}"),
        (4, "propensity", f"'0' {chance}"),
        (5, "time", "is missing"),
        (5, "order", f"'1.5' {whole}"),
        (5, "propensity", f"'NaN' {chance}"),
        (6, "order", f"'inf' {whole}"),
        (6, "propensity", f"'1.1' {chance}"),
    ]
    assert error.total == 11
    assert {fault.file for fault in error.faults} == {str(file)}
    assert f"{file}, row 2, user: is missing\n" in str(error)


@pytest.mark.parametrize("name", FORMATS)
def test_all_faults_are_counted_and_the_first_are_told(
    tmp_path: Path, name: str
) -> None:
    rows = [PLAIN | {"order": str(n) if n % 2 else "x"} for n in range(1000)]
    files = [write(tmp_path / f"{part}-{name}", rows) for part in "ab"]

    error = faults(files)

    assert error.total == 1000
    assert [fault.row for fault in error.faults] == list(range(1, 41, 2))
    assert {fault.file for fault in error.faults} == {str(files[0])}
    assert str(error).endswith("\nAnd 980 more.")


@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        ({"signal": "love"}, "'love' is no signal; known are skip, like, none"),
        ({"fraction": "-0.1"}, "'-0.1' is no share from 0 to 1, or at most 10"),
        ({"fraction": "85"}, "'85' is no share from 0 to 1, or at most 10"),
        ({"fraction": "nan"}, "'nan' is no share from 0 to 1, or at most 10"),
        ({"fraction": "all"}, "'all' is no share from 0 to 1, or at most 10"),
        ({"like": "yes" * 99}, f"'{'yes' * 20}…' is neither 0 nor 1"),
    ],
)
def test_an_answer_that_is_none_is_told(
    tmp_path: Path, answer: Row, complaint: str
) -> None:
    row = {"user": "ann", "item": "a", "order": 1} | answer

    error = faults([write(tmp_path / "log.csv", [row])])

    assert said(error) == [(1, *answer, complaint)]


@pytest.mark.parametrize("told", [{"like": 1}, {"fraction": 1}])
def test_an_answer_that_the_signals_leave_open_is_refused(
    tmp_path: Path, told: Row
) -> None:
    row = {"user": "ann", "item": "a", "order": 1} | told
    scale = Scale(("left", "stayed"), (0, 1), None)

    [fault] = faults([write(tmp_path / "log.csv", [row])], scale=scale).faults

    assert [fault.column] == list(told)


HEADER = b"user,item,order,like\n"


@pytest.mark.parametrize(
    ("name", "content", "row", "complaint"),
    [
        ("a.csv", b"", None, "is empty"),
        ("a.csv", b"user,item,item,like\n", None, "names a column twice"),
        ("a.csv", HEADER + b"a,b,1,1\na,b,c,2,1\n", 2, "is broken: 5 cells, where"),
        ("a.csv", HEADER + b'a,b,1,1\n"a"b,c,2,1\n', 2, "is broken: "),
        ("a.csv", HEADER + b'"a\n\n",b,1,1\n\n"a,b,2,1\n', 3, "is broken: "),
        ("a.csv", HEADER + b"a,b,1,1\n\xff,b,2,1\n", 2, "is not UTF-8"),
        ("a.csv", b"\xff" + HEADER, 1, "is not UTF-8"),
        ("a.csv.gz", b"no gzip", None, "cannot be read: "),
        ("a.ndjson", b'{"user": 1}\n\n{"user": \n', 2, "is broken: "),
        ("a.ndjson", b'{"user": 1}\n[1]\n', 2, "is broken: no object"),
        ("a.ndjson", b'{"user": 1}\n{"like": NaN}\n', 2, "is broken: NaN is no"),
        ("a.ndjson", b'{"user": 1}\n{"like": 1e999}\n', 2, "is broken: 1e999 is no"),
        ("a.ndjson", b'{"user": 1}\n{"user": "\xff"}\n', 2, "is not UTF-8"),
        ("a.ndjson", b"[" * 100_000, 1, "is broken: "),
        ("a.parquet", b"no Parquet at all", None, "cannot be read: "),
        ("a.txt", b"", None, "is of no known format: give .csv, "),
    ],
)
def test_where_a_file_is_broken_is_told(
    tmp_path: Path, name: str, content: bytes, row: int | None, complaint: str
) -> None:
    file = tmp_path / name
    file.write_bytes(content)

    [fault] = faults([file]).faults

    assert (fault.file, fault.row) == (str(file), row)
    assert fault.message.startswith(complaint)


def test_a_parquet_cut_short_is_told(tmp_path: Path) -> None:
    file = write(tmp_path / "log.parquet", [PLAIN | {"user": n} for n in range(999)])
    plain = bytearray(file.read_bytes())
    plain[4:2000] = bytes(1996)
    file.write_bytes(plain)

    [fault] = faults([file]).faults

    assert fault.file == str(file)
    assert fault.message.startswith("cannot be read: ")


def test_a_column_of_lists_is_refused(tmp_path: Path) -> None:
    pl.DataFrame([PLAIN | {"item": ["a"]}]).write_parquet(tmp_path / "log.parquet")

    [fault] = faults([tmp_path]).faults

    assert fault.column == "item"
    assert fault.message.startswith("holds neither text nor numbers")


def test_files_must_agree_in_their_columns(tmp_path: Path) -> None:
    files = [
        write(tmp_path / "a.csv", [PLAIN]),
        write(tmp_path / "b.csv", [{"user": "ann", "item": "a", "order": 2}]),
    ]

    assert faults(files).faults == (
        Fault(str(files[1]), None, "like", "is no column of this file"),
    )


def test_a_log_without_plays_is_refused(tmp_path: Path) -> None:
    empty = tmp_path / "a.csv"
    empty.write_bytes(HEADER)
    (tmp_path / "b.csv").write_bytes(HEADER + b"\n\n,,,\n")

    assert said(faults([empty])) == [(None, None, "there is no play")]
    assert said(faults([tmp_path])) == [(None, None, "there is no play")]
    assert said(faults([])) == [(None, None, "there is no file")]
    assert "No such file" in str(faults([tmp_path / "none.csv"]))


def test_an_empty_file_beside_others_is_no_fault(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(HEADER)
    (tmp_path / "b.ndjson").write_bytes(b"")
    write(tmp_path / "c.parquet", [PLAIN])

    assert len(read([tmp_path])) == 1


def test_csv_is_taken_as_it_comes(tmp_path: Path) -> None:
    """A byte order mark, lines of Windows, blank ones, and quoted ones."""
    head, tail = HEADER.replace(b"\n", b"\r\n"), b'"a,\r\n""b""",c,2,1\r\n\r\n'
    file = tmp_path / "log[1]*.csv"
    file.write_bytes(b"\xef\xbb\xbf" + head + b"\r\na,c,1,0\r\n" + tail)

    plays = read([file])

    assert plays.users == ("a", 'a,\r\n"b"')
    assert_array_equal(plays.answer, [0, 1])


def test_names_of_files_are_no_patterns(tmp_path: Path) -> None:
    for ending in ("csv", "ndjson", "parquet"):
        file = write(tmp_path / f"log[1]*.{ending}", [PLAIN | {"item": ending}])

        assert read([file]).arms == (ending,)


def test_a_history_that_encore_exports_is_read(tmp_path: Path) -> None:
    at = "2026-03-01T20:15:00.250000+00:00"
    first: Row = {"user": "ann", "item": "a", "signal": "like", "at": at}
    beside = {"item": "b", "signal": "none", "fraction": 0.9, "together": True}
    file = tmp_path / "history.ndjson"
    file.write_text(f"{json.dumps(first)}\n{json.dumps({**first, **beside})}\n")

    plays = read([file])

    assert plays.arms == ("a", "b")
    assert_array_equal(plays.answer, [1, NONE])


def test_learning_needs_no_polars_before_a_log_is_read() -> None:
    program = """
import importlib.util, sys
find = importlib.util.find_spec
importlib.util.find_spec = lambda name: None if name == "polars" else find(name)
import learning
assert "polars" not in sys.modules
try:
    import learning.reading
except ModuleNotFoundError as error:
    assert error.name == "polars" and "`learn`" in str(error)
else:
    raise AssertionError
"""
    subprocess.run([sys.executable, "-W", "error", "-c", program], check=True)
