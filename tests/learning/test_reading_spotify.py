"""What Spotify gives to its listeners is read as it came."""

import json
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from zipfile import ZipFile

import pytest
from numpy.testing import assert_array_equal

from learning.reading import InvalidLog, read_spotify
from tests.learning.written import Row

NOON = datetime(2026, 3, 1, 12, tzinfo=UTC).timestamp()
LONG = 200_000  # milliseconds


def extended(second: int, track: str | None, played: int = LONG, **more: object) -> Row:
    return {
        "ts": datetime.fromtimestamp(NOON + second, UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "platform": "ios",
        "ms_played": played,
        "master_metadata_track_name": track,
        "master_metadata_album_artist_name": None if track is None else f"{track}'s",
        "spotify_track_uri": None,
        "episode_name": None,
        "reason_start": "clickrow",
        "reason_end": "trackdone",
        "skipped": False,
    } | more


def short(minute: int, track: str, played: int = LONG) -> Row:
    return {
        "endTime": f"2026-03-01 12:{minute:02}",
        "artistName": f"{track}'s",
        "trackName": track,
        "msPlayed": played,
    }


def exported(folder: Path, rows: Sequence[object], name: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(json.dumps(rows))
    return folder


def audio(folder: Path, rows: Sequence[object], number: int = 0) -> Path:
    return exported(folder, rows, f"Streaming_History_Audio_2026_{number}.json")


def liked(folder: Path, like_fraction: float = 0.8) -> list[int]:
    plays = read_spotify([folder], like_fraction=like_fraction)
    return [int(answer) for answer in plays.answer]


def test_plays_are_in_the_order_of_their_ends(tmp_path: Path) -> None:
    audio(tmp_path / "ann", [extended(500, "c"), extended(0, "á", username="Zoë")], 2)
    audio(tmp_path / "ann", [extended(100, "b"), extended(300, "c", 50_500)], 10)

    plays = read_spotify([tmp_path / "ann"])

    assert plays.users == ("Zoë", "ann")
    assert_array_equal(plays.user, [0, 1, 1, 1])
    assert [plays.arms[arm] for arm in plays.arm] == ["á's", "b's", "c's", "c's"]
    assert plays.seconds is not None
    began = plays.seconds - NOON
    assert_array_equal(began, [-200, -100, 249.5, 300])
    assert plays.signals == ("skip", "like")


def test_starts_are_raised_where_ends_are_told_to_the_minute(tmp_path: Path) -> None:
    rows = [short(4, "a"), short(5, "b", 2_000), short(5, "c", 40_000), short(9, "d")]
    exported(tmp_path / "ann", rows, "StreamingHistory0.json")

    plays = read_spotify([tmp_path / "ann"], arm="track")

    assert plays.arms == ("a's - a", "b's - b", "c's - c", "d's - d")
    assert_array_equal(plays.arm, [0, 1, 2, 3])
    assert plays.seconds is not None
    assert_array_equal(plays.seconds - NOON, [40, 298, 298, 340])


def test_a_like_is_what_went_on_to_its_end(tmp_path: Path) -> None:
    reasons = [
        ("trackdone", 1_000, False),
        ("fwdbtn", LONG, False),
        ("backbtn", LONG, False),
        ("endplay", LONG, True),
        ("endplay", LONG, None),
        ("logout", 0.8 * LONG, False),
        ("unknown", 0.7 * LONG, False),
        (None, 0.9 * LONG, None),
    ]
    rows = [
        extended(second, "a", int(played), reason_end=reason, skipped=skipped)
        for second, (reason, played, skipped) in enumerate(reasons)
    ]
    folder = audio(tmp_path / "ann", rows)

    assert liked(folder) == [1, 0, 0, 0, 1, 1, 0, 1]
    assert liked(folder, 0.85) == [1, 0, 0, 0, 1, 0, 0, 1]


def test_lengths_are_those_of_the_longest_play_of_anybody(tmp_path: Path) -> None:
    rows = [short(1, "a", 100_000), short(2, "b", 44_999), short(3, "c", 45_000)]
    ann = exported(tmp_path / "ann", rows, "StreamingHistory_music_0.json")
    bob = exported(tmp_path / "bob", [short(1, "a")], "StreamingHistory1.json")

    assert liked(ann) == [1, 0, 1]
    assert_array_equal(read_spotify([ann, bob]).answer, [0, 0, 1, 1])


def test_only_plays_of_music_are_taken(tmp_path: Path) -> None:
    rows = [extended(0, None), extended(1, ""), extended(2, "a")]
    folder = audio(tmp_path / "ann", rows)
    exported(folder, [extended(3, "b")], "Streaming_History_Video_2026.json")
    exported(folder, [short(1, "c")], "StreamingHistory_podcast_0.json")
    exported(folder, [{"name": "ann"}], "Userdata.json")

    assert read_spotify([folder]).arms == ("a's",)


def test_of_both_kinds_the_extended_one_is_taken(tmp_path: Path) -> None:
    exported(tmp_path / "ann" / "MyData", [short(1, "a")], "StreamingHistory0.json")
    exported(tmp_path / "ann" / "more", [extended(60, "a")], "endsong_0.json")

    assert len(read_spotify([tmp_path / "ann"])) == 1


def test_a_zip_is_read_as_it_came(tmp_path: Path) -> None:
    inside = "Spotify Extended Streaming History/Streaming_History_Audio_2026_0.json"
    with ZipFile(tmp_path / "ann.zip", "w") as zipped:
        zipped.writestr(inside, json.dumps([extended(0, "a")]))
        zipped.writestr(f"__MACOSX/._{Path(inside).name}", b"\0")
    bob = audio(tmp_path / "bob", [extended(0, "b")])

    plays = read_spotify([tmp_path / "ann.zip", bob])
    of_files = read_spotify(sorted(bob.iterdir()))

    assert plays.users == ("ann", "bob")
    assert plays.arms == ("a's", "b's")
    assert of_files.users == ("bob",)


def refused(*exports: Path) -> list[str]:
    with pytest.raises(InvalidLog) as error:
        read_spotify(exports)
    return [str(fault) for fault in error.value.faults]


def test_what_is_wrong_is_told_by_row(tmp_path: Path) -> None:
    wrong = [
        extended(0, "a"),
        extended(0, None, ts="podcasts do not count"),
        extended(0, "a", ts="noon"),
        extended(0, "a", ms_played=None),
        extended(0, "a", ms_played=-1),
    ]
    folder = audio(tmp_path / "ann", wrong)
    [file] = folder.iterdir()

    assert refused(folder) == [
        f"{file}, row 3, ts: 'noon' is no moment",
        f"{file}, row 4, ms_played: is missing",
        f"{file}, row 5, ms_played: '-1' is no number of milliseconds",
    ]


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("[{", "is no JSON: "),
        ("{}", "is no array of plays"),
        ("[" * 100_000, "is no JSON: "),
        ("[{}, 1]", "row 2: is no object"),
        ("[]", "there is no play of music"),
    ],
)
def test_a_history_that_is_none_is_refused(
    tmp_path: Path, content: str, complaint: str
) -> None:
    (audio(tmp_path, []) / "Streaming_History_Audio_2026_0.json").write_text(content)

    [fault] = refused(tmp_path)

    assert complaint in fault


def test_an_export_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "broken.zip").write_bytes(b"PK")
    one, other = (audio(tmp_path / f"{n}" / "MyData", [extended(0, "a")]) for n in "12")

    assert refused(tmp_path / "none") == [
        f"{tmp_path / 'none'}: cannot be read: No such file or directory"
    ]
    assert "has no streaming history of Spotify" in refused(tmp_path / "broken.zip")[0]
    assert "is a second export named 'MyData': rename one" in refused(one, other)[0]
