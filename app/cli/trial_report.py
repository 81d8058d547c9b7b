"""What a trial of policies found, for people."""

from collections.abc import Sequence

from app.cli.console import say, show_table
from app.services.trials import Start, Trial, Tried

COLUMNS = ("policy", "reward", "over the first", "under the bound", "decision")
NAMED = 3  # models whose plays are told


def show(trial: Trial) -> None:
    """Show a row for each policy, the bound, and what was simulated."""
    first, *others = trial.policies
    rows = [_row(first, ""), *(_row(other, _difference(other)) for other in others)]
    show_table(COLUMNS, rows)
    say()
    for tried in trial.policies:
        say(f"{tried.label} plays {_most_played(trial.models, tried.play_shares)}.")
    say()
    if trial.bound is None:
        say(f"{_unbounded(trial)}, so that there is no bound.")
    else:
        say(f"No policy earns more than {trial.bound:.4f} on average.")
    say(
        f"{sum(trial.items)} items of {len(trial.models)} models, {trial.runs} users"
        f" from the start of their listening, {trial.slots} plays each; later ones add"
        f" at most {trial.remainder:.4f}. Discount {trial.discount}, seed {trial.seed}."
    )


def _unbounded(trial: Trial) -> str:
    if trial.start is Start.STATE:
        return "Beliefs are wrong at the start"
    return "Moods join the items"


def _row(tried: Tried, difference: str) -> tuple[str, ...]:
    return (
        tried.label,
        f"{tried.mean:.4f} ± {tried.ci95:.4f}",
        difference,
        _gap(tried),
        f"{tried.decision_us:.0f} µs",
    )


def _gap(tried: Tried) -> str:
    if tried.gap is None:
        return ""
    if tried.gap_percent is None:
        return f"{tried.gap:.4f}"
    return f"{tried.gap:.4f} ({tried.gap_percent:.2f} %)"


def _difference(tried: Tried) -> str:
    return f"{tried.difference:+.4f} ± {tried.difference_ci95:.4f}"


def _most_played(models: Sequence[str], shares: Sequence[float]) -> str:
    ranked = sorted(zip(shares, models, strict=True), key=lambda pair: -pair[0])
    first, rest = ranked[:NAMED], ranked[NAMED:]
    shown = [*first, (sum(share for share, _ in rest), "others")]
    return ", ".join(
        f"{name} {share:.0%}" for share, name in shown if round(100 * share) > 0
    )
