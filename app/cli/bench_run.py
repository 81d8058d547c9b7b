"""What `encore bench` does once its options are understood."""

from collections.abc import Iterator
from contextlib import contextmanager

from app.cli import bench_report
from app.cli.console import Failed, progress, show_json
from app.load import bench
from app.load.bench import Unanswered
from app.load.crew import Ended, Told
from app.load.plan import Plan, Wishes
from app.load.report import as_json as described

FAULTY = "The service did not keep its promises."


def run(plan: Plan, processes: int, wishes: Wishes, *, as_json: bool) -> None:
    """Load the service, tell what came of it, and fail if it broke a promise."""
    try:
        outcome = bench.run(plan, processes, wishes, watched)
    except Unanswered as error:
        raise Failed(f"Nothing was answered: {error}") from error
    except Ended as error:
        raise Failed(str(error)) from error
    if as_json:
        show_json(described(outcome))
    else:
        bench_report.show(outcome)
    if not outcome.kept_promises:
        raise Failed(FAULTY)


@contextmanager
def watched(name: str, total: float | None) -> Iterator[Told]:
    """Show how a part goes, by what it tells."""
    with progress() as bar:
        task = bar.add_task(name, total=total)

        def told(answered: int, failed: int) -> None:
            what = f"{name}, {failed} failed" if failed else name
            bar.update(task, completed=answered + failed, description=what)

        yield told
