"""What a trial of policies found, for people."""

from app.cli.console import say, show_table
from app.services.trials import Trial, Tried

COLUMNS = ("policy", "reward", "over the first", "under the bound", "decision")


def show(trial: Trial) -> None:
    """Show a row for each policy, the bound, and what was simulated."""
    first, *others = trial.policies
    rows = [_row(first, ""), *(_row(other, _difference(other)) for other in others)]
    show_table(COLUMNS, rows)
    say()
    say(f"No policy earns more than {trial.bound:.4f} on average.")
    say(
        f"{sum(trial.items)} items of {len(trial.models)} models, {trial.runs} users"
        f" from the start of their listening, {trial.slots} plays each; later ones add"
        f" at most {trial.remainder:.4f}. Discount {trial.discount}, seed {trial.seed}."
    )


def _row(tried: Tried, difference: str) -> tuple[str, ...]:
    return (
        tried.label,
        f"{tried.mean:.4f} ± {tried.ci95:.4f}",
        difference,
        f"{tried.gap:.4f} ({tried.gap_percent:.2f} %)",
        f"{tried.decision_us:.0f} µs",
    )


def _difference(tried: Tried) -> str:
    return f"{tried.difference:+.4f} ± {tried.difference_ci95:.4f}"
