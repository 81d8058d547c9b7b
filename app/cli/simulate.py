"""`encore simulate`: what policies earn, and how much any policy could."""

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress, TaskID

from app.api.schemas.lines import ITEMS, MODELS
from app.cli import trial_report
from app.cli.console import AsJson, Failed, note, progress, show_json
from app.cli.contenders import Policies, PolicyFile, entrant, entrants_in
from app.cli.files import opened
from app.cli.importing import FormatOption, refused
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.errors import InvalidImport, MoodsDiffer, TooLargeToBound
from app.services import bounds, entrants, model_imports, openings, trials
from app.services.beside import beside
from app.services.entrants import Entrant
from app.services.formats import Format
from app.services.openings import Opening
from app.services.trials import Score, Setting, Start, Trial
from app.storage.store import Store
from simulation import Course
from simulation import Progress as Told
from simulation.examples import IN_STATES, NUMBERS

USUAL = ("random", "best_fixed", "myopic", "whittle", "exact_rollout")
PATIENCE = 60  # seconds after which it is told beforehand how long it takes
MOST_PATIENCE = 24 * 3600

ExampleNumber = Annotated[
    int | None,
    typer.Option(
        "--example",
        min=1,
        max=4,
        help="An example of the paper; the fourth is drawn by the seed.",
        show_default=False,
    ),
]
Models = Annotated[
    Path | None,
    typer.Option(
        "--models",
        help="Models to have one item each, as `import models` reads them."
        " Left out: the active items of the database.",
        show_default=False,
    ),
]
Items = Annotated[
    Path | None,
    typer.Option(
        "--items",
        help="Items of these models, as `import items` reads them.",
        show_default=False,
    ),
]


def command(
    *,
    example: ExampleNumber = None,
    models: Models = None,
    items: Items = None,
    format_: FormatOption = None,
    policy: Policies = None,
    policies: PolicyFile = None,
    start: Annotated[
        Start,
        typer.Option(
            help="Hidden states follow the beliefs, or are the paper's; of examples."
        ),
    ] = Start.BELIEF,
    score: Annotated[
        Score, typer.Option(help="Plays earn what is expected, or what is answered.")
    ] = Score.EXPECTED,
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
    first: Annotated[
        int, typer.Option(help="Number of the first user: to go on with a seed.")
    ] = 0,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Compare policies with each other, and with what no policy can exceed.

    For users who are new to a catalogue: an example of the paper, a file, or the
    database.
    """
    course = _course(runs, slots, discount, seed, first)
    given = [entrant(text, discount) for text in policy or ()]
    if policies is not None:
        given.extend(entrants_in(policies, discount))
    wanted: Sequence[Entrant] = given or [entrant(name, discount) for name in USUAL]
    states = _states(start, example)
    if models is None:
        _needs_models("--items", items)
        _needs_models("--format", format_)
    if example is not None:
        _alone("--example", models=models, database_url=database_url)
        opening = openings.of_example(example, seed)
    elif models is not None:
        _alone("--models", database_url=database_url)
        opening = _of_files(models, items, format_)
    else:
        opening, wanted = _of_database(database_url, wanted, usual=not given)
    setting = Setting(wanted, opening, course, states, score)
    _warn(setting, depth)
    trial = _tried(setting, depth)
    if as_json:
        show_json({"example": example} | asdict(trial))
    else:
        trial_report.show(trial)


def _course(
    runs: int, slots: int | None, discount: float, seed: int, first: int
) -> Course:
    try:
        return trials.course(runs, slots, discount, seed, first)
    except ValueError as error:
        raise Failed(f"--{error}.", status=2) from error


def _states(start: Start, example: int | None) -> Sequence[int] | None:
    if start is Start.BELIEF:
        return None
    if example not in NUMBERS:
        told = ", ".join(map(str, NUMBERS))
        raise Failed(f"--start state: only --example {told} have states.", status=2)
    return IN_STATES


def _alone(option: str, **others: object) -> None:
    for name, value in others.items():
        if value is not None:
            other = name.replace("_", "-")
            raise Failed(f"{option} does not go with --{other}.", status=2)


def _needs_models(option: str, value: object) -> None:
    if value is not None:
        raise Failed(f"{option} goes with --models.", status=2)


def _of_files(models: Path, items: Path | None, format_: Format | None) -> Opening:
    try:
        with opened(models, format_, MODELS) as lines:
            known = model_imports.read(lines)
        if items is None:
            return openings.of_models(known)
        with opened(items, format_, ITEMS) as lines:
            return openings.of_files(known, lines)
    except InvalidImport as error:
        raise refused(error) from error
    except MoodsDiffer as error:
        raise Failed(f"{models}: {error.detail}") from error


def _of_database(
    database_url: str | None, wanted: Sequence[Entrant], *, usual: bool
) -> tuple[Opening, Sequence[Entrant]]:
    """The catalogue, and before the usual policies the one in force."""

    async def task(session: Session) -> tuple[Opening, Sequence[Entrant]]:
        def work(store: Store) -> tuple[Opening, Sequence[Entrant]]:
            opening = openings.present(store, session.live)
            if usual:
                return opening, entrants.with_the_one_in_force(store, wanted)
            return opening, wanted

        return await session.database.run(work)

    return perform(configured(database_url=database_url), task)


def _warn(setting: Setting, depth: int) -> None:
    """Tell what will take long; refuse what would take days."""
    opening, course = setting.opening, setting.course
    expected = setting.expected_seconds
    if setting.is_bounded:
        expected += _seconds_to_bound(opening, course.discount, depth)
    told = f"{len(opening.models)} models, {course.runs} runs"
    if expected > MOST_PATIENCE:
        raise Failed(
            f"This would take about {expected / 86400:.0f} days ({told}): ask for"
            " fewer --runs or --slots, or for other policies."
        )
    if expected > PATIENCE:
        note(f"About {expected / 60:.0f} minutes ({told}).")


def _seconds_to_bound(opening: Opening, discount: float, depth: int) -> float:
    try:
        return bounds.expected_seconds(opening, discount, depth, bounds.OF_A_COMMAND)
    except TooLargeToBound as error:
        (fault,) = error.faults
        raise Failed(f"{error.detail} --{fault.field}: {fault.message}.") from error


def _tried(setting: Setting, depth: int) -> Trial:
    most = None
    with progress() as bar:
        if setting.is_bounded:
            waiting = bar.add_task("bound", total=None)
            discount, limits = setting.course.discount, bounds.OF_A_COMMAND
            work = partial(bounds.certified, setting.opening, discount, depth, limits)
            most = beside(work).result()
            bar.remove_task(waiting)
        preparing, playing = (_shown(bar, what) for what in ("index tables", "users"))
        ready = beside(partial(trials.prepared, setting, preparing)).result()
        values = trials.tried(setting, ready, playing)
    return trials.reported(setting, depth, most, values)


def _shown(bar: Progress, what: str) -> Told:
    """Show a share of some work in percent, from when it is first told."""
    tasks: list[TaskID] = []

    def tell(share: float) -> None:
        if not tasks:
            tasks.append(bar.add_task(what, total=100))
        bar.update(tasks[0], completed=int(100 * share))

    return tell
