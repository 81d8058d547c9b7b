"""The policy in force: seen, swapped, rolled back."""

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Body

from app.api.context import Administering
from app.api.problems import responses
from app.api.schemas.pages import (
    HIGHEST,
    CursorQuery,
    Limit,
    decode_number,
    encode,
)
from app.api.schemas.policy import (
    EXAMPLES,
    AnyPolicyForm,
    PolicyInForce,
    PolicyPage,
    PresentPolicy,
    RollbackForm,
)
from app.errors import NoEarlierPolicy, SamplesApart, TooManyStates
from app.services import policy

router = APIRouter(prefix="/v1/admin", tags=["policy"])


@router.get("/policy")
async def get_policy(caller: Administering) -> PresentPolicy:
    """Show the policy in force."""
    return PresentPolicy.of(await caller.database.run(policy.current))


@router.put("/policy", responses=responses(SamplesApart, TooManyStates))
async def swap_policy(
    caller: Administering,
    form: Annotated[AnyPolicyForm, Body(openapi_examples=EXAMPLES)],
) -> PresentPolicy:
    """Put a policy in force, for every request that comes after this one.

    If it needs index tables, rough ones are made for models that have none.
    """
    swapped = await caller.database.run(
        partial(
            policy.swap,
            described=form.described(),
            note=form.note,
            by=caller.key.id,
        )
    )
    caller.context.index_builder.wake()
    return PresentPolicy.of(swapped)


@router.get("/policies")
async def list_policies(
    caller: Administering, limit: Limit = 100, cursor: CursorQuery = None
) -> PolicyPage:
    """List all policies that were put in force, the latest first."""
    before = decode_number(cursor, HIGHEST)
    page = await caller.database.run(
        partial(policy.history, before=before, limit=limit)
    )
    return PolicyPage(
        policies=[PolicyInForce.model_validate(version) for version in page.versions],
        next=encode(page.next),
    )


@router.post(
    "/policy/rollback",
    responses=responses(NoEarlierPolicy, SamplesApart, TooManyStates),
)
async def roll_back_policy(
    caller: Administering, form: RollbackForm | None = None
) -> PresentPolicy:
    """Return to the policy before the one in force; again, to the one before that."""
    note = "" if form is None else form.note
    restored = await caller.database.run(
        partial(policy.roll_back, note=note, by=caller.key.id)
    )
    caller.context.index_builder.wake()
    return PresentPolicy.of(restored)
