"""Experiments: users split between policies, and what comes of it."""

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Body, Query
from fastapi.openapi.models import Example

from app.api.context import Administering
from app.api.problems import responses
from app.api.schemas.experiments import (
    ExperimentForm,
    ExperimentPage,
    ExperimentVersion,
    ExperimentView,
)
from app.api.schemas.fields import Note
from app.api.schemas.pages import HIGHEST, CursorQuery, Limit, decode_number, encode
from app.errors import (
    ExperimentFixed,
    ExperimentNotFound,
    ExperimentRuns,
    InvalidCursor,
    TooManyStates,
    UnusableExperiment,
)
from app.services import experiment_reports, experiments

router = APIRouter(prefix="/v1/admin", tags=["policy"])
EXAMPLES: dict[str, Example] = {
    "two arms and a holdout": {
        "value": {
            "name": "look-ahead",
            "arms": [
                {"name": "control", "share": 0.45},
                {"name": "myopic", "policy": {"name": "myopic"}, "share": 0.45},
            ],
            "holdout": 0.1,
            "note": "is planning ahead worth it?",
        }
    },
    "a shadow": {
        "value": {
            "name": "deeper",
            "shadows": [
                {
                    "name": "depth-2",
                    "policy": {"name": "exact_rollout", "params": {"depth": 2}},
                }
            ],
        }
    },
}


@router.get("/experiment", responses=responses(ExperimentNotFound))
async def get_experiment(
    caller: Administering,
    version: Annotated[
        int | None, Query(ge=1, le=HIGHEST, description="another than the latest")
    ] = None,
) -> ExperimentView:
    """Show the experiment that runs, or the last one: what each arm earns."""
    report = partial(experiment_reports.report, version=version)
    return ExperimentView.of_report(await caller.database.run(report))


@router.put(
    "/experiment",
    responses=responses(
        ExperimentRuns, ExperimentFixed, TooManyStates, UnusableExperiment
    ),
)
async def put_experiment(
    caller: Administering,
    form: Annotated[ExperimentForm, Body(openapi_examples=EXAMPLES)],
) -> ExperimentView:
    """Begin an experiment, or change the shares, arms or shadows of the one that runs.

    Every request that comes after this one obeys it.
    """
    put = partial(
        experiments.put,
        new=form.experiment(),
        least=caller.context.settings.experiment_least_share,
        by=caller.key.id,
    )
    version = await caller.database.run(put)
    caller.context.index_builder.wake()
    return await get_experiment(caller, version)


@router.delete("/experiment", responses=responses(ExperimentNotFound))
async def end_experiment(
    caller: Administering, note: Annotated[Note, Query()] = ""
) -> ExperimentView:
    """End the experiment that runs: the policy in force serves all users again."""
    end = partial(experiments.end, note=note, by=caller.key.id)
    return await get_experiment(caller, await caller.database.run(end))


@router.get("/experiments", responses=responses(InvalidCursor))
async def list_experiments(
    caller: Administering, limit: Limit = 100, cursor: CursorQuery = None
) -> ExperimentPage:
    """List the versions of all experiments, the latest first."""
    before = decode_number(cursor, HIGHEST)
    page = await caller.database.run(
        partial(experiments.history, before=before, limit=limit)
    )
    return ExperimentPage(
        experiments=[ExperimentVersion.of(each) for each in page.versions],
        next=encode(page.next),
    )
