"""What could be earned: a certified bound, to judge any policy by."""

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query

from app.api.context import Administering
from app.api.problems import responses
from app.api.schemas.bounds import BoundView
from app.api.schemas.indexes import Discount
from app.errors import NothingToPlay, TooLargeToBound
from app.services import bounds

router = APIRouter(prefix="/v1/admin", tags=["policy"])
Depth = Annotated[
    int,
    Query(ge=0, le=2, description="plays of look-ahead; more of them may lower it"),
]


@router.get("/bound", responses=responses(NothingToPlay, TooLargeToBound))
async def get_bound(
    caller: Administering, discount: Discount = None, depth: Depth = 1
) -> BoundView:
    """Tell what no policy can exceed with a new user, and what one item earns.

    Both in discounted rewards, for the present catalogue. The bound is certified; how
    far a policy stays below it, `encore simulate` finds.
    """
    look = partial(bounds.outlook, live=caller.live, discount=discount, depth=depth)
    return BoundView.of(await caller.database.run(look))
