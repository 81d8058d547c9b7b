"""Results as Markdown."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from benchmarks.peers.competitor import Competitor
from benchmarks.peers.contest import Results
from benchmarks.peers.encore import BLIND
from policies import Floats

HEAD = """\
| | starts from | discounted likes | likes a slot | µs |
| --- | --- | --- | --- | --- |"""


class Estimate(NamedTuple):
    """A mean over listeners, the catalogues given, with its 95 % interval."""

    mean: float
    margin: float

    @classmethod
    def of(cls, values: Floats) -> "Estimate":
        """Estimate from (C, L) values."""
        catalogues, listeners = values.shape
        spread = values.var(axis=1, ddof=1).mean()
        margin = 1.96 * (spread / (catalogues * listeners)) ** 0.5
        return cls(float(values.mean()), float(margin))

    def shown(self, digits: int) -> str:
        return f"{self.mean:.{digits}f} ± {self.margin:.{digits}f}"


def table(competitors: Sequence[Competitor], results: Results) -> str:
    rows = [
        row(competitors[k], results, k)
        for k in (*encores(competitors), *best(competitors, results))
    ]
    return "\n".join([HEAD, *rows])


def row(competitor: Competitor, results: Results, k: int) -> str:
    hidden = competitor.encore or not competitor.setting
    name = competitor.name if hidden else f"{competitor.name}, {competitor.setting}"
    cells = [
        name,
        competitor.start,
        Estimate.of(results.likes[k]).shown(2),
        Estimate.of(results.rate[k]).shown(3),
        f"{results.microseconds[k]:.0f}",
    ]
    return f"| {' | '.join(cells)} |"


def encores(competitors: Sequence[Competitor]) -> list[int]:
    return [k for k, entry in enumerate(competitors) if entry.encore]


def best(competitors: Sequence[Competitor], results: Results) -> list[int]:
    """Return each peer's best settings: by discounted likes, and by likes a slot."""
    groups: dict[tuple[str, str], list[int]] = {}
    for k, entry in enumerate(competitors):
        if not entry.encore:
            groups.setdefault((entry.name, entry.start), []).append(k)
    shown: dict[int, None] = {}
    for group in groups.values():
        for values in (results.likes, results.rate):
            shown[max(group, key=lambda k: float(values[k].mean()))] = None
    return list(shown)


def losses(competitors: Sequence[Competitor], results: Results) -> Iterator[str]:
    """Say where a peer beats a policy, by more than the interval of the difference."""
    for k in encores(competitors):
        entry = competitors[k]
        found = [
            lost(competitors, k, results.likes, "{} discounted likes", digits=2),
            lost(competitors, k, results.rate, "{} likes a slot", digits=3),
        ]
        if any(found) and entry.setting not in BLIND:
            yield f"- {entry.name}, {entry.start}: {', '.join(filter(None, found))}"


def lost(
    competitors: Sequence[Competitor], k: int, values: Floats, what: str, digits: int
) -> str:
    """Compare competitor k with the peer that earned most, listener by listener."""
    peers = [n for n, entry in enumerate(competitors) if not entry.encore]
    peer = max(peers, key=lambda n: float(values[n].mean()))
    lead = Estimate.of(values[peer] - values[k])
    if lead.mean <= lead.margin:
        return ""
    winner = competitors[peer]
    return f"{what.format(lead.shown(digits))} to {winner.name} from {winner.start}"
