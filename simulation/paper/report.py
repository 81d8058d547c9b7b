"""The report: Markdown, and the same as a page."""

import csv
import statistics
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from markdown_it import MarkdownIt

from simulation.paper.claims import Claim, claims
from simulation.paper.parts import BELIEF, STATE
from simulation.paper.rows import Part, Row

if TYPE_CHECKING:
    import _csv

TITLE = "The paper, reproduced and corrected"
PAPER = (
    "Meshram and Kaza (2021), *Monte Carlo Rollout Policy for Recommendation Systems"
    " with Dynamic User Behavior*, [arXiv:2102.04321](https://arxiv.org/abs/2102.04321)"
)


class Section(NamedTuple):
    """A title, and what its figure shows."""

    title: str
    caption: str


SECTIONS: Mapping[str, Section] = MappingProxyType(
    {
        "example-1": Section(
            "Example 1: structure, it is said",
            "Cumulative discounted likes by slot, all of them, and what was played."
            " Above: hidden states follow the beliefs. Below: they are the paper's,"
            " which contradict the beliefs, so that no bound holds.",
        ),
        "noise": Section(
            "Example 1: where the reversal comes from",
            "Rollout above myopic, by the number of trajectories. A trajectory's sum"
            " of clicks has a standard deviation of about one, and the two best items"
            " are about a tenth apart: one hundred trajectories cannot tell which is"
            " better. Expected rewards with common random numbers can, and without"
            " sampling there is no noise at all.",
        ),
        "structure": Section(
            "Instances with the structure that the paper names",
            "Five items each, drawn: matrices totally positive of order 2, so that rows"
            " rise stochastically, and like chances that rise. Above: the mean over"
            " instances. Below: gains over myopic, and how far policies stay below the"
            " Lagrangian upper bound.",
        ),
        "example-2": Section(
            "Example 2: no structure",
            "As above. The optimum is known in closed form: item 3 once, then item 4"
            " for ever.",
        ),
        "example-3": Section(
            "Example 3: rest leads to the second state",
            "As above. The optimum is known in closed form: item 1 for ever.",
        ),
        "truncation": Section(
            "Example 3: an index that looks a few slots ahead",
            "The Monte Carlo index, by how far it looks ahead, between the converged"
            " index and other policies.",
        ),
        "example-4": Section(
            "Example 4: fifteen items",
            "The paper prints no numbers of its instance; these are drawn: every row"
            " of the matrices and of the priors even over all distributions, like"
            " chances sorted. Above: the mean over instances. Below: gains over myopic,"
            " and how far policies stay below the Lagrangian upper bound.",
        ),
        "items": Section(
            "Beyond: more items",
            "Drawn as in example 4, on average over instances, each item with a model"
            " of its own: where many share a model, the unplayed ones are one group,"
            " and the time does not grow with their number. Policies that look up index"
            " tables are shown up to fifty models.",
        ),
        "horizon": Section(
            "Beyond: further ahead",
            "Exact rollout with a myopic base, by its horizon.",
        ),
        "robustness": Section(
            "Beyond: wrong parameters",
            "Example 2, planned with parameters that are mixed with chance: with that"
            " weight every row of the matrices and the priors are random, and like"
            " chances move towards random ones. Intervals are over the mistakes.",
        ),
    }
)
COLUMNS: Mapping[str, str] = MappingProxyType(
    {
        "group": "group",
        "policy": "label",
        "x": "x",
        "runs": "runs",
        "mean": "mean",
        "ci95": "ci95",
        "above first": "difference",
        "above first ci95": "difference_ci95",
        "decision, µs": "decision_us",
    }
)
STYLE = """
:root { color-scheme: light dark; --line: #d8d8d8; --soft: #f4f4f4; --ink: #1c1c1c;
  --paper: #fff; }
@media (prefers-color-scheme: dark) { :root { --line: #3c3c3c; --soft: #242424;
  --ink: #e6e6e6; --paper: #161616; } }
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background:
  var(--paper); max-width: 62rem; margin: 2rem auto; padding: 0 1.2rem; }
h1, h2 { line-height: 1.2; } h2 { margin-top: 3rem; }
img { width: 100%; background: #fff; padding: .6rem; box-sizing: border-box; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: .86rem; }
th, td { text-align: left; padding: .35rem .7rem; border-bottom: 1px solid
  var(--line); vertical-align: top; font-variant-numeric: tabular-nums; }
th { background: var(--soft); } code { background: var(--soft); padding: .1em .3em; }
"""


def write(parts: Mapping[str, Part], folder: Path, made: str) -> None:
    """Write tables, the report in Markdown, and as a page.

    Args:
        parts: all of them.
        folder: where the figures are, too.
        made: how: the command, the machine, the time that it took.
    """
    for name, part in parts.items():
        _write_table(part, folder / "tables" / f"{name}.csv")
    text = markdown(parts, made)
    (folder / "report.md").write_text(text, encoding="utf-8")
    (folder / "report.html").write_text(page(text), encoding="utf-8")


def markdown(parts: Mapping[str, Part], made: str) -> str:
    """Return the report in Markdown."""
    found = claims(parts)
    return "\n".join([*_head(found, made), *_sections(parts)]) + "\n"


def page(text: str) -> str:
    """Return the report as a page, whose figures are vectors."""
    body = MarkdownIt("commonmark").enable("table").render(text)
    body = body.replace("<table>", '<div class="wide"><table>')
    body = body.replace("</table>", "</table></div>").replace(".png", ".svg")
    for title, _ in SECTIONS.values():
        heading = f"<h2>{escape(title)}</h2>"
        body = body.replace(heading, f'<h2 id="{anchor(title)}"{heading[3:]}')
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(TITLE)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"{body}</body>\n</html>\n"
    )


def _head(found: Sequence[Claim], made: str) -> Iterator[str]:
    yield f"# {TITLE}"
    yield ""
    yield f"{PAPER}. {made}"
    yield ""
    yield (
        "Rewards are discounted likes (0.95 a slot), each play scored by what the exact"
        " filter expects of it, with 95 % intervals; all policies meet the same random"
        " numbers. Differences are paired."
    )
    yield ""
    yield "## What the paper says, and what was found"
    yield ""
    yield "| the paper | verdict | found | figure |"
    yield "| --- | --- | --- | --- |"
    for claim in found:
        title = SECTIONS[claim.figure].title
        link = f"[{title}](#{anchor(title)})"
        yield f"| {claim.claim} | **{claim.verdict}** | {claim.evidence} | {link} |"
    yield ""


def anchor(title: str) -> str:
    """Return the name of a section in links, as most readers of Markdown make it."""
    kept = (letter for letter in title.lower() if letter.isalnum() or letter in " -")
    return "".join(kept).replace(" ", "-")


def _sections(parts: Mapping[str, Part]) -> Iterator[str]:
    for name, (title, caption) in SECTIONS.items():
        part = parts[name]
        yield f"## {title}"
        yield ""
        yield f"![{title}](figures/{name}.png)"
        yield ""
        yield caption
        yield ""
        if part.series:
            yield from _of_instances(part)
        elif part.marks:
            yield from _of_starts(part)
        else:
            yield from _of_lines(part)
        yield ""
        table, results = f"tables/{name}.csv", f"results/{name}.json"
        each = f"tables/{name}-instances.csv"
        instances = f", [{each}]({each})" if part.series else ""
        yield (
            f"Numbers: [{table}]({table}){instances}; all of them:"
            f" [{results}]({results})."
        )
        yield ""


def _of_starts(part: Part) -> Iterator[str]:
    marks = ", ".join(f"{name} {mark:.4f}" for name, mark in part.marks.items())
    yield f"With the start as believed: {marks}."
    yield ""
    yield (
        "| policy | start=belief | above myopic | start=state | above myopic | plays"
        " most (start=belief) | a decision |"
    )
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for row, other in zip(part.group(BELIEF), part.group(STATE), strict=True):
        yield (
            f"| {row.label} | {_mean(row)} | {_difference(row)} | {_mean(other)}"
            f" | {_difference(other)} | {_most(row)} | {row.decision_us:.0f} µs |"
        )


def _mean(row: Row) -> str:
    return f"{row.mean:.3f} ± {row.ci95:.3f}"


def _difference(row: Row) -> str:
    return f"{row.difference:+.3f} ± {row.difference_ci95:.3f}"


def _most(row: Row) -> str:
    ranked = sorted(enumerate(row.shares, 1), key=lambda pair: -pair[1])
    return ", ".join(
        f"item {item} {share:.0%}" for item, share in ranked[:2] if round(100 * share)
    )


def _of_instances(part: Part) -> Iterator[str]:
    yield "| policy | mean reward | above myopic | a decision |"
    yield "| --- | --- | --- | --- |"
    for row in part.rows:
        yield (
            f"| {row.label} | {_mean(row)} | {_difference(row)}"
            f" | {row.decision_us:.0f} µs |"
        )
    yield ""
    told = ", ".join(f"{name} {mark:.0f}" for name, mark in part.marks.items())
    yield f"Of each instance ({told}):"
    yield ""
    yield "| | least | median | greatest |"
    yield "| --- | --- | --- | --- |"
    for name, values in part.series.items():
        if not name.startswith("error"):
            ranked = sorted(values)
            middle = statistics.median(ranked)
            yield f"| {name}, % | {ranked[0]:.2f} | {middle:.2f} | {ranked[-1]:.2f} |"


def _of_lines(part: Part) -> Iterator[str]:
    yield "| | policy | x | reward | above myopic | a decision |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for row in part.rows:
        at = "" if row.x is None else f"{row.x:g}"
        yield (
            f"| {row.group} | {row.label} | {at} | {_mean(row)} | {_difference(row)}"
            f" | {row.decision_us:.0f} µs |"
        )


def _write_table(part: Part, file: Path) -> None:
    """Write the rows; and beside them, where there are, what each instance gave."""
    with _opened(file) as table:
        table.writerow(COLUMNS)
        fields = COLUMNS.values()
        table.writerows([getattr(row, name) for name in fields] for row in part.rows)
    if part.series:
        with _opened(file.with_stem(f"{file.stem}-instances")) as table:
            table.writerow(("seed", *part.series))
            values = zip(*part.series.values(), strict=True)
            table.writerows((seed, *row) for seed, row in enumerate(values))


@contextmanager
def _opened(file: Path) -> "Iterator[_csv.Writer]":
    with file.open("w", newline="", encoding="utf-8") as opened:
        yield csv.writer(opened, lineterminator="\n")
