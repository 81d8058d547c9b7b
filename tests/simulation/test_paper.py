"""The paper reproduced: what is simulated, how claims are judged, what is written."""

import csv
import json
from collections.abc import Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from markdown_it import MarkdownIt
from numpy.testing import assert_allclose
from PIL import Image

from simulation import drawn, example, half_width, ordered
from simulation.paper import PARTS, Part, Scale, claims, figures, parts, report
from simulation.paper.claims import Claim, Verdict, is_monotone, is_tp2
from simulation.paper.labels import (
    EXACT,
    EXPECTED,
    FIXED,
    MYOPIC,
    PAPER,
    RANDOM_BASE,
    WHITTLE,
    entry,
)
from simulation.paper.parts import BELIEF, STATE, mistaken
from simulation.paper.report import SECTIONS
from simulation.paper.rows import Row, Trial, corrected

COMMITTED = Path(__file__).parents[2] / "docs" / "paper"
TINY = Scale(0.001)
REPRODUCED, EXPLAINED = Verdict.REPRODUCED, Verdict.EXPLAINED
NOT_REPRODUCED, UNKNOWN = Verdict.NOT_REPRODUCED, Verdict.CANNOT_BE_CHECKED


@pytest.fixture(scope="module")
def found() -> Mapping[str, Part]:
    """The full reproduction, as it was committed."""
    return {
        name: Part.of(
            json.loads((COMMITTED / "results" / f"{name}.json").read_text())["part"]
        )
        for name in PARTS
    }


def verdicts(found: Mapping[str, Part]) -> list[Verdict]:
    return [claim.verdict for claim in claims(found)]


def test_the_papers_claims_stand_as_the_committed_report_says(
    found: Mapping[str, Part],
) -> None:
    assert verdicts(found) == [
        REPRODUCED,
        EXPLAINED,
        NOT_REPRODUCED,
        REPRODUCED,
        REPRODUCED,
        REPRODUCED,
        NOT_REPRODUCED,
        EXPLAINED,
        EXPLAINED,
        UNKNOWN,
        NOT_REPRODUCED,
        REPRODUCED,
    ]


def test_the_committed_report_is_what_is_written_of_its_numbers(
    found: Mapping[str, Part],
) -> None:
    text = (COMMITTED / "report.md").read_text()
    made = text[text.index("Made by") :].partition("\n")[0]

    assert report.markdown(found, made) == text
    assert report.page(text) == (COMMITTED / "report.html").read_text()


@pytest.mark.parametrize(
    ("number", "label", "start", "known", "rounding"),
    [
        (1, MYOPIC, BELIEF, 14.105, 0.01),
        (2, MYOPIC, BELIEF, 8.136, 0.005),
        (3, MYOPIC, BELIEF, 11.378, 0.005),
        (1, PAPER, BELIEF, 13.58, 0.045),
        (2, PAPER, BELIEF, 8.81, 0.025),
        (3, PAPER, BELIEF, 12.58, 0.065),
        (1, EXPECTED, BELIEF, 14.23, 0.01),
        (2, EXPECTED, BELIEF, 8.95, 0.01),
        (3, EXPECTED, BELIEF, 12.83, 0.01),
        (1, RANDOM_BASE, BELIEF, 13.16, 0.05),
        (2, RANDOM_BASE, BELIEF, 7.89, 0.05),
        (3, RANDOM_BASE, BELIEF, 10.81, 0.05),
        (1, EXACT, BELIEF, 14.23, 0.01),
        (2, EXACT, BELIEF, 8.95, 0.01),
        (3, EXACT, BELIEF, 12.83, 0.01),
        (1, WHITTLE, BELIEF, 14.234, 0.01),
        (2, WHITTLE, BELIEF, 8.986, 0.005),
        (3, WHITTLE, BELIEF, 12.967, 0.01),
        (1, MYOPIC, STATE, 13.07, 0.01),
        (1, EXACT, STATE, 13.319, 0.01),
        (2, MYOPIC, STATE, 8.33, 0.01),
        (2, PAPER, STATE, 8.73, 0.1),
        (2, EXACT, STATE, 9.00, 0.01),
        (2, WHITTLE, STATE, 9.07, 0.01),
        (3, MYOPIC, STATE, 10.747, 0.005),
        (3, WHITTLE, STATE, 12.248, 0.002),
        (3, PAPER, STATE, 12.42, 0.1),
        (3, EXACT, STATE, 12.92, 0.01),
    ],
)
def test_what_policies_earn_is_what_others_have_measured(
    found: Mapping[str, Part],
    number: int,
    label: str,
    start: str,
    known: float,
    rounding: float,
) -> None:
    row = found[f"example-{number}"].row(start, label)

    assert abs(row.mean - known) < rounding + 1.5 * row.ci95


def test_closed_forms_stand_beside_them(found: Mapping[str, Part]) -> None:
    marks = [found[f"example-{number}"].marks for number in (1, 2, 3)]

    assert_allclose(
        [mark[FIXED] for mark in marks], [14.1238, 8.9508, 12.9631], atol=5e-5
    )
    assert marks[1]["optimum"] == pytest.approx(8.986321013638, abs=1e-9)
    assert marks[2]["optimum"] == pytest.approx(12.963117368826, abs=1e-9)
    for mark in marks:
        assert mark["bound"] > mark.get("optimum", mark[FIXED]) - 1e-9
        assert mark["bound"] < mark.get("optimum", 14.30) + 1e-5


def changed(part: Part, label: str, **fields: float) -> Part:
    """A part in which all rows of a policy say otherwise."""
    rows = [
        replace(row, **fields) if row.label == label else row  # type: ignore[arg-type]
        for row in part.rows
    ]
    return replace(part, rows=rows)


@pytest.mark.parametrize(
    ("claim", "name", "label", "fields", "verdict"),
    [
        (0, "example-1", PAPER, {"difference": 1.0}, NOT_REPRODUCED),
        (0, "example-1", PAPER, {"difference_ci95": 9.0}, UNKNOWN),
        (1, "noise", PAPER, {"difference_ci95": 9.0}, UNKNOWN),
        (1, "noise", EXACT, {"difference": -1.0}, UNKNOWN),
        (1, "noise", PAPER, {"difference": 1.0}, NOT_REPRODUCED),
        (3, "example-2", PAPER, {"difference": -1.0}, NOT_REPRODUCED),
        (4, "example-2", MYOPIC, {"shares": (1, 0, 0, 0, 0)}, NOT_REPRODUCED),
        (5, "example-2", PAPER, {"shares": (0, 0, 1, 0, 0)}, NOT_REPRODUCED),
        (6, "example-3", MYOPIC, {"mean": 99.0}, REPRODUCED),
        (6, "example-3", WHITTLE, {"mean": 1.0}, EXPLAINED),
        (7, "example-3", PAPER, {"mean": 99.0}, REPRODUCED),
        (7, "example-3", PAPER, {"mean": 1.0}, NOT_REPRODUCED),
        (8, "example-3", WHITTLE, {"decision_us": 1e6}, REPRODUCED),
        (8, "example-3", PAPER, {"decision_us": 1e6}, NOT_REPRODUCED),
        (10, "example-4", PAPER, {"difference": 1.0}, REPRODUCED),
        (10, "example-4", PAPER, {"difference_ci95": 9.0}, UNKNOWN),
        (11, "items", EXPECTED, {"decision_us": 1e6}, NOT_REPRODUCED),
        (11, "items", EXPECTED, {"difference_ci95": 9.0}, NOT_REPRODUCED),
    ],
)
def test_other_numbers_would_be_judged_otherwise(
    found: Mapping[str, Part],
    claim: int,
    name: str,
    label: str,
    fields: dict[str, float],
    verdict: Verdict,
) -> None:
    other = {**found, name: changed(found[name], label, **fields)}

    assert verdicts(other)[claim] is verdict
    assert verdicts(found)[claim] is not verdict


@pytest.mark.parametrize("seed", range(20))
def test_instances_with_the_structure_have_all_of_it(seed: int) -> None:
    for model in ordered(seed, 5):
        for matrix in (model.play, model.rest):
            assert is_monotone(matrix)
            assert is_tp2(matrix)
        assert (np.diff(model.like) > 0).all()
        assert model.prior.sum() == pytest.approx(1)
    first, other = (ordered(seed + step, 1)[0].play for step in (0, 1))
    assert not np.allclose(first, other)


@pytest.mark.parametrize(
    ("matrix", "monotone", "tp2"),
    [
        (np.eye(3), True, True),
        (np.eye(3)[::-1], False, False),
        (np.full((3, 3), 1 / 3), True, True),
        ([[0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]], True, False),
    ],
)
def test_structure_is_what_textbooks_call_so(
    matrix: object, *, monotone: bool, tp2: bool
) -> None:
    rows = np.array(matrix)

    assert is_monotone(rows) is monotone
    assert is_tp2(rows) is tp2


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of a few runs and points."""
    changes = {
        "LEAST_RUNS": 2,
        "TRAJECTORIES": (10, 100),
        "CUTS": (1, 2),
        "COUNTS": (5, 60),
        "HORIZONS": (1, 2),
        "WRONG": (0.0, 0.3),
        "INSTANCES": 2,
        "SHORT": 5,
    }
    for name, value in changes.items():
        monkeypatch.setattr(parts, name, value)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("name", PARTS)
def test_every_part_is_simulated_told_and_kept(name: str) -> None:
    told: list[float] = []

    part = PARTS[name](TINY, told.append)

    assert told == sorted(told)
    assert told[-1] == pytest.approx(1)
    assert as_kept(part).plain() == json.loads(json.dumps(part.plain()))
    for row in part.rows:
        assert 0 < row.mean < 20
        assert len(row.curve) == len(row.curve_ci95)


@pytest.mark.usefixtures("few")
def test_a_part_simulated_again_is_the_same_but_for_times() -> None:
    first, second = (PARTS["noise"](TINY, lambda _share: None) for _ in range(2))

    assert without_times(first) == without_times(second)


def as_kept(part: Part) -> Part:
    return Part.of(json.loads(json.dumps(part.plain())))


def without_times(part: Part) -> Part:
    return replace(part, rows=[replace(row, decision_us=0.0) for row in part.rows])


def test_what_more_users_tell_of_the_first_policy_corrects_the_others() -> None:
    start, rng = example(1).start, np.random.default_rng(2)
    few, many = (entry(WHITTLE, runs) for runs in (60, 2000))

    _, row = Trial("g", start, [entry(MYOPIC, 2000), few], slots=30).rows()
    [alone, _] = Trial("g", start, [few, entry(MYOPIC, 60)], slots=30).rows()
    [truth, _] = Trial("g", start, [many, few], slots=30).rows()

    assert row.ci95 < 0.9 * alone.ci95
    assert abs(row.mean - truth.mean) < 1.5 * np.hypot(row.ci95, truth.ci95)
    first = rng.normal(size=1000)
    mean, half = corrected(2 * first[:50] + 3, first)
    assert mean == pytest.approx(2 * first.mean() + 3)
    assert half == pytest.approx(2 * half_width(first), rel=1e-6)
    mean, half = corrected(first[:50], np.ones(100))
    assert (mean, half) == (first[:50].mean(), half_width(first[:50]))


def test_wrong_parameters_are_as_wrong_as_asked() -> None:
    true = drawn(3, 4)

    same, half = mistaken(true, 0.0, 1), mistaken(true, 0.5, 1)

    for model, kept, wrong in zip(true, same, half, strict=True):
        assert_allclose(kept.play, model.play, atol=1e-12)
        assert (wrong.play >= 0.5 * model.play - 1e-12).all()
        assert not np.allclose(wrong.rest, model.rest)


def test_figures_are_drawn_as_vectors_and_pixels(
    found: Mapping[str, Part], tmp_path: Path
) -> None:
    names = [*figures.draw(found, tmp_path)]

    assert names == [*SECTIONS] == [*PARTS]
    for name in names:
        file = tmp_path / f"{name}.svg"
        root = ET.parse(file).getroot()  # noqa: S314 - our own
        texts = "".join(root.itertext())
        assert "nan" not in texts
        assert ("likes" in texts) or ("instances" in texts)
        with Image.open(tmp_path / f"{name}.png") as image:
            assert image.width > 1000
            assert len(image.convert("L").getcolors() or range(300)) > 10
    again = tmp_path / "again"
    again.mkdir()
    [first] = islice(figures.draw(found, again), 1)
    one, other = ((at / f"{first}.svg").read_bytes() for at in (tmp_path, again))
    assert one == other


def test_every_claim_names_a_figure_and_every_link_leads_somewhere(
    found: Mapping[str, Part], tmp_path: Path
) -> None:
    for folder in ("figures", "tables"):
        (tmp_path / folder).mkdir()

    report.write(found, tmp_path, "Made by hand.")

    text = (tmp_path / "report.md").read_text()
    assert {claim.figure for claim in claims(found)} <= {*SECTIONS}
    anchors = {f"#{report.anchor(section.title)}" for section in SECTIONS.values()}
    tokens = MarkdownIt("commonmark").enable("table").parse(text)
    links = {
        str(part.attrs["href"])
        for token in tokens
        for part in token.children or ()
        if part.type == "link_open"
    }
    local = {link for link in links if not link.startswith("https://")}
    assert {link for link in local if link.startswith("#")} <= anchors
    for name in PARTS:
        assert f"results/{name}.json" in local
    tables = {link for link in local if link.startswith("tables/")}
    assert len(tables) == len(PARTS) + 2
    for link in tables:
        rows = [*csv.reader((tmp_path / link).read_text().splitlines())]
        assert len(rows) > 2
        assert all(len(row) == len(rows[0]) for row in rows)
    page = (tmp_path / "report.html").read_text()
    assert page.count("<img") == len(SECTIONS)
    for anchor in anchors:
        assert f'id="{anchor[1:]}"' in page


def test_a_claim_is_told_with_its_evidence(found: Mapping[str, Part]) -> None:
    for claim in claims(found):
        assert isinstance(claim, Claim)
        assert claim.evidence.endswith(".")
        assert "nan" not in claim.evidence


def test_rows_are_found_by_what_they_are() -> None:
    row = Row("a", "myopic", 1.0, 2, 3.0, 0.1, 0.0, 0.0, 1.0)
    part = Part("p", [row, replace(row, x=2.0)])

    assert part.row("a", "myopic", 2.0).x == 2.0
    with pytest.raises(ValueError, match="not enough values"):
        part.row("a", "myopic", 3.0)
