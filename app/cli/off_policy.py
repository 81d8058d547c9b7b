"""`encore off-policy`: what other policies would have earned, by a log alone."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from app.api.schemas.lines import MODELS
from app.cli import logs, verdicts
from app.cli.console import AsJson, Failed, progress, show_json
from app.cli.contenders import Policies, PolicyFile, entrant, entrants_in
from app.cli.files import opened
from app.cli.importing import refused
from app.cli.session import DatabaseUrl, configured, perform_unit
from app.cli.spreads import spreading
from app.errors import InvalidImport
from app.services import logs as kept
from app.services import model_imports, off_policies
from app.services.entrants import Entrant
from app.services.items import NewItem
from app.services.off_policies import Question, Verdict
from learning import Plays
from learning.em import Effort, Spread
from learning.fitting import Recipe
from learning.off_policy import Rules


def command(
    files: logs.Files = None,
    *,
    policy: Policies = None,
    policies: PolicyFile = None,
    user: logs.User = None,
    arm: logs.Arm = None,
    at: logs.Time = None,
    order: logs.Order = None,
    signal: logs.Signal = None,
    fraction: logs.Fraction = None,
    like: logs.Like = None,
    propensity: logs.Propensity = None,
    unit: logs.TimeUnit = None,
    database_url: DatabaseUrl = None,
    models: Annotated[
        Path | None,
        typer.Option(
            "--models",
            help="Models, as `import models` reads them, of the --items. Left out:"
            " those of the database; of files, learned from half of the users.",
            show_default=False,
        ),
    ] = None,
    items: Annotated[
        Path | None,
        typer.Option(
            "--items",
            help="Items of these models, as `import items` reads them.",
            show_default=False,
        ),
    ] = None,
    states: Annotated[
        int, typer.Option(min=2, max=8, help="Of models that are learned.")
    ] = 4,
    types: Annotated[
        int, typer.Option(min=1, max=32, help="How many models are learned.")
    ] = 1,
    in_a_row: Annotated[
        int, typer.Option(min=1, max=20, help="Choices in a row, at most.")
    ] = 4,
    clip: Annotated[
        float | None,
        typer.Option(help="Where weights are cut off.", show_default=False),
    ] = None,
    draws: Annotated[
        int, typer.Option(min=1, help="Users drawn anew so often, for intervals.")
    ] = 1000,
    discount: Annotated[
        float, typer.Option(help="At which policies plan that do.")
    ] = 0.95,
    seed: Annotated[int, typer.Option(min=0, help="Of all random numbers.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Say what other policies would have earned, of a log that tells propensities.

    Plays are weighed by the chance with which the other policy would have made them
    over that with which they were made. What a log cannot answer is refused, with the
    reason; if it can answer nothing about a policy, the command ends with 1.
    """
    columns = {
        "user": user,
        "arm": arm,
        "time": at,
        "order": order,
        "signal": signal,
        "fraction": fraction,
        "like": like,
        "propensity": propensity,
    }
    wanted = logs.Wanted(files or (), columns, unit, None, database_url)
    asked = _asked(policy, policies, discount)
    recipe = Recipe(states=states, types=types, effort=Effort(seed=seed))
    try:
        rules = Rules(in_a_row=in_a_row, clip=clip, draws=draws, seed=seed)
        with spreading(None) as spread:
            question = _question(wanted, models, items, recipe, spread)
            found = _judged(question, asked, rules, spread)
    except ValueError as error:
        raise Failed(f"{error}.") from error
    if as_json:
        show_json(off_policies.plain(question, rules, found))
    else:
        verdicts.show(question, found)
    if any(verdict.refused for verdict in found):
        raise typer.Exit(1)


def _asked(
    policy: Sequence[str] | None, policies: Path | None, discount: float
) -> Sequence[Entrant]:
    asked = [entrant(text, discount) for text in policy or ()]
    if policies is not None:
        asked.extend(entrants_in(policies, discount))
    if not asked:
        raise Failed("Name a --policy.", status=2)
    return asked


def _question(
    wanted: logs.Wanted,
    models: Path | None,
    items: Path | None,
    recipe: Recipe,
    spread: Spread,
) -> Question:
    if (models is None) != (items is None):
        raise Failed("--models and --items go together.", status=2)
    plays = logs.read(wanted)
    if models is not None:
        return _by_files(plays, models, logs.items(wanted, items) or ())
    if wanted.files:
        return off_policies.by_learned_models(plays, recipe, spread)
    known = perform_unit(configured(database_url=wanted.database_url), kept.models_now)
    return off_policies.by_kept_models(plays, known, logs.items(wanted, None) or ())


def _by_files(plays: Plays, models: Path, items: Sequence[NewItem]) -> Question:
    try:
        with opened(models, None, MODELS) as lines:
            return off_policies.by_new_models(plays, model_imports.read(lines), items)
    except InvalidImport as error:
        raise refused(error) from error


def _judged(
    question: Question, asked: Sequence[Entrant], rules: Rules, spread: Spread
) -> Sequence[Verdict]:
    with progress() as bar:
        return [
            off_policies.judge(question, each, rules, spread)
            for each in bar.track(asked, description="policies")
        ]
