"""`encore bound`: what policies earn, and how much any policy could."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress, TaskID

from app.api.schemas.lines import MODELS
from app.cli import trial_report
from app.cli.console import AsJson, Failed, note, progress, show_json
from app.cli.files import opened
from app.cli.importing import FormatOption, refused
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.errors import InvalidImport, TooLargeToBound
from app.services import bounds, entrants, model_imports, openings, trials
from app.services.entrants import Entrant
from app.services.formats import Format, json_object
from app.services.openings import Opening
from app.services.trials import Trial
from app.storage.store import Store
from simulation import Course

USUAL = ("random", "best_fixed", "myopic", "whittle", "exact_rollout")
PATIENCE = 60  # seconds after which it is told beforehand how long it takes
MOST_PATIENCE = 24 * 3600

Models = Annotated[
    Path | None,
    typer.Option(
        "--models",
        help="Models to have one item each, as `import models` reads them."
        " Left out: the active items of the database.",
        show_default=False,
    ),
]
Policies = Annotated[
    list[str] | None,
    typer.Option(
        "--policy",
        help="A policy to try: NAME or NAME={PARAMETERS AS JSON}. Repeatable.",
        show_default=False,
    ),
]


@dataclass(frozen=True, slots=True)
class Field:
    """Who tries what: the items, and the policies."""

    opening: Opening
    entrants: Sequence[Entrant]


def command(
    *,
    models: Models = None,
    format_: FormatOption = None,
    policy: Policies = None,
    runs: Annotated[int, typer.Option(help="Simulated users.")] = 1000,
    slots: Annotated[
        int | None,
        typer.Option(
            help="Plays of each. Left out: until a reward counts a ten thousandth.",
            show_default=False,
        ),
    ] = None,
    depth: Annotated[
        int, typer.Option(min=0, max=6, help="Look-ahead of the bound.")
    ] = 1,
    discount: Annotated[
        float, typer.Option(help="Worth of the next reward against one now.")
    ] = 0.95,
    seed: Annotated[int, typer.Option(help="Of all random numbers.")] = 1,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Compare policies with each other, and with what no policy can exceed.

    For a user who is new to the catalogue.
    """
    course = _course(runs, slots, discount, seed)
    wanted = [_entrant(text, discount) for text in policy or USUAL]
    if models is None:
        field = _of_database(database_url, wanted, usual=not policy)
    else:
        field = Field(_of_file(models, format_), wanted)
    _warn(field, course, depth)
    trial = _tried(field, course, depth)
    if as_json:
        show_json(asdict(trial))
    else:
        trial_report.show(trial)


def _course(runs: int, slots: int | None, discount: float, seed: int) -> Course:
    try:
        return trials.course(runs, slots, discount, seed)
    except ValueError as error:
        raise Failed(f"--{error}.", status=2) from error


def _entrant(text: str, discount: float) -> Entrant:
    name, _, given = text.partition("=")
    try:
        return entrants.entrant(name, json_object(given or "{}"), discount)
    except ValueError as error:
        raise Failed(f"--policy {name}: {error}.", status=2) from error


def _of_file(file: Path, format_: Format | None) -> Opening:
    try:
        with opened(file, format_, MODELS) as lines:
            return openings.of_models(model_imports.read(lines))
    except InvalidImport as error:
        raise refused(error) from error


def _of_database(
    database_url: str | None, wanted: Sequence[Entrant], *, usual: bool
) -> Field:
    """The catalogue, and before the usual policies the one in force."""

    async def task(session: Session) -> Field:
        def work(store: Store) -> Field:
            opening = openings.present(store, session.live)
            if usual:
                return Field(opening, entrants.with_the_one_in_force(store, wanted))
            return Field(opening, wanted)

        return await session.database.run(work)

    return perform(configured(database_url=database_url), task)


def _warn(field: Field, course: Course, depth: int) -> None:
    """Tell what will take long; refuse what would take days."""
    opening, limits = field.opening, bounds.OF_A_COMMAND
    try:
        bounding = bounds.expected_seconds(opening, course.discount, depth, limits)
    except TooLargeToBound as error:
        (fault,) = error.faults
        raise Failed(f"{error.detail} --{fault.field}: {fault.message}.") from error
    expected = bounding + trials.expected_seconds(field.entrants, opening, course)
    told = f"{len(field.opening.models)} models, {course.runs} runs"
    if expected > MOST_PATIENCE:
        raise Failed(
            f"This would take about {expected / 86400:.0f} days ({told}): ask for"
            " fewer --runs or --slots, or for other policies."
        )
    if expected > PATIENCE:
        note(f"About {expected / 60:.0f} minutes ({told}).")


def _tried(field: Field, course: Course, depth: int) -> Trial:
    opening, tried = field.opening, field.entrants
    with progress() as bar:
        waiting = bar.add_task("bound", total=None)
        limits = bounds.OF_A_COMMAND
        most = bounds.certified(opening, course.discount, depth, limits)
        bar.remove_task(waiting)
        preparing, playing = (_shown(bar, what) for what in ("index tables", "users"))
        values = trials.tried(tried, opening, course, preparing, playing)
    return trials.reported(tried, opening, course, depth, most, values)


def _shown(bar: Progress, what: str) -> trials.Progress:
    """Show a share of some work in percent, from when it is first told."""
    tasks: list[TaskID] = []

    def tell(share: float) -> None:
        if not tasks:
            tasks.append(bar.add_task(what, total=100))
        bar.update(tasks[0], completed=int(100 * share))

    return tell
