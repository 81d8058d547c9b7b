"""An evaluation as a table, in Markdown."""

from collections.abc import Iterator

from learning.evaluation.scores import Evaluation, Interval, Score

COLUMNS = (
    "forecaster",
    "log loss",
    "95 % interval",
    "difference",
    "95 % interval",
    "better for",
    "Brier",
    "AUC",
    "ECE",
)


def table(evaluation: Evaluation) -> str:
    """Return a line for each forecaster.

    "Better for" says for how many users a forecaster is better than the first.
    """
    return "\n".join(_lines(evaluation)) + "\n"


def _lines(evaluation: Evaluation) -> Iterator[str]:
    yield _line(COLUMNS)
    yield _line(["---", *(["---:"] * (len(COLUMNS) - 1))])
    first = evaluation.scores[0]
    yield _line(_cells(first, "", "", ""))
    for score in evaluation.scores[1:]:
        better = (score.by_user < first.by_user).sum()
        yield _line(
            _cells(
                score,
                f"{score.difference:+.4f}",
                _interval(score.difference_ci95, "+.4f"),
                f"{better} of {len(first.by_user)}",
            )
        )


def _cells(score: Score, *compared: str) -> list[str]:
    return [
        score.forecaster.replace("|", "\\|"),
        f"{score.log_loss:.4f}",
        _interval(score.log_loss_ci95, ".4f"),
        *compared,
        f"{score.brier:.4f}",
        f"{score.auc:.4f}",
        f"{score.by_count.error:.4f}",
    ]


def _interval(ends: Interval, form: str) -> str:
    return " to ".join(format(end, form) for end in ends)


def _line(cells: list[str] | tuple[str, ...]) -> str:
    return f"| {' | '.join(cells)} |"
