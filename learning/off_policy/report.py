"""What a log answers, for people and for programs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby

from learning.off_policy.cannot import CannotAnswer
from learning.off_policy.intervals import Estimate
from learning.off_policy.support import Support

HEAD = (
    "| estimate | choices in a row | a play earns | more than the log | worth plays |",
    "| --- | --- | --- | --- | --- |",
)
MATCHES = "matches"


@dataclass(frozen=True, slots=True)
class Answer:
    """An estimate of what a play earns under the policy.

    Attributes:
        method: `replay`, `ips`, `snips` or `dr` of one choice; `pdis` or
            `weighted_pdis` of several. Or `matches`, the mean of the plays on which the
            policy agrees with a log that left nothing to chance: that says what these
            plays earned, not what the policy would.
        in_a_row: how many choices the policy had made, that of the play the last.
        estimate: of the reward.
        gain: by which it is above the log's.
        effective: plays of the policy that this is worth.
    """

    method: str
    in_a_row: int
    estimate: Estimate
    gain: Estimate
    effective: float


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why there is no estimate."""

    method: str
    in_a_row: int
    why: CannotAnswer


@dataclass(frozen=True, slots=True)
class Report:
    """What a log answers about a policy.

    Attributes:
        choices: plays whose arm was chosen with a chance that is known.
        answered: of them.
        users: who gave these answers.
        logged: what a play of the log earned.
        promised: what a play of the policy earns if the models are right.
        support: of one choice, of two in a row, and so on.
        answers: by method.
    """

    choices: int
    answered: int
    users: int
    logged: Estimate
    promised: Estimate
    support: Sequence[Support]
    answers: Sequence[Answer | Refusal]

    @property
    def refused(self) -> bool:
        """Return whether nothing tells what the policy would have earned."""
        return not any(
            isinstance(each, Answer) and each.method != MATCHES for each in self.answers
        )

    def plain(self) -> Mapping[str, object]:
        """Return what JSON can hold."""
        return {
            "choices": self.choices,
            "answered": self.answered,
            "users": self.users,
            "refused": self.refused,
            "logged": asdict(self.logged),
            "promised": asdict(self.promised),
            "support": [
                {
                    "in_a_row": row + 1,
                    **asdict(each),
                    "unsupported": each.unsupported,
                }
                for row, each in enumerate(self.support)
            ],
            "answers": [_plain(each) for each in self.answers],
        }

    def markdown(self) -> str:
        """Return a table, and why what is missing is."""
        rows = (
            f"| {each.method} | {each.in_a_row} | {_told(each.estimate)} |"
            f" {_told(each.gain, '+')} | {each.effective:,.0f} |"
            for each in self.answers
            if isinstance(each, Answer)
        )
        logged, promised = _told(self.logged), _told(self.promised)
        head = (
            f"{self.answered:,} answered plays of {self.users:,} users, whose arms were"
            f" chosen with chances that are known. They earned {logged} each; if the"
            f" models are right, the policy earns {promised}."
        )
        table = "\n".join((*HEAD, *rows))
        return "\n\n".join((head, table, *self._refusals())) + "\n"

    def _refusals(self) -> Iterator[str]:
        refused = (each for each in self.answers if isinstance(each, Refusal))
        for why, group in groupby(refused, key=lambda each: each.why):
            names = ", ".join(f"`{each.method}` ({each.in_a_row})" for each in group)
            yield f"No {names}: {why.detail} (`{why.reason}`)."


def _told(estimate: Estimate, sign: str = "") -> str:
    mean, low, high = (
        format(value, f"{sign}.4f")
        for value in (estimate.mean, estimate.low, estimate.high)
    )
    return f"{mean} ({low} to {high})"


def _plain(each: Answer | Refusal) -> Mapping[str, object]:
    if isinstance(each, Answer):
        return asdict(each)
    return {
        "method": each.method,
        "in_a_row": each.in_a_row,
        "reason": str(each.why.reason),
        "detail": each.why.detail,
    }
