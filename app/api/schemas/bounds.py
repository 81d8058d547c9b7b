"""Forms of bounds."""

from typing import Annotated, Self

from pydantic import Field

from app.api.schemas.fields import Form
from app.services.bounds import Outlook


class FixedView(Form):
    """The best item to play for ever, by its model."""

    model: str
    value: Annotated[float, Field(description="exact; what the best policy exceeds")]


class BoundView(Form):
    """What can be earned from a new user, in discounted rewards."""

    discount: float
    depth: int
    models: Annotated[int, Field(description="models that active items have")]
    items: Annotated[int, Field(description="active items")]
    bound: Annotated[
        float | None,
        Field(description="what no policy exceeds on average; null: see reason"),
    ]
    price: Annotated[float | None, Field(description="of a slot of rest, at the bound")]
    best_fixed: FixedView | None
    gap: Annotated[
        float | None, Field(description="from the best fixed item to the bound")
    ]
    gap_percent: Annotated[float | None, Field(description="of the bound")]
    reason: Annotated[
        str | None, Field(description="why there is no bound; null: there is one")
    ]

    @classmethod
    def of(cls, outlook: Outlook) -> Self:
        found, fixed, gap, most = outlook.bound, outlook.best_fixed, None, None
        if found is not None and fixed is not None:
            most, gap = found.value, max(found.value - fixed.value, 0.0)
        return cls(
            discount=outlook.discount,
            depth=outlook.depth,
            models=len(outlook.opening.models),
            items=sum(outlook.opening.items),
            bound=most,
            price=None if found is None else found.price,
            best_fixed=None
            if fixed is None
            else FixedView(model=fixed.model, value=fixed.value),
            gap=gap,
            gap_percent=_percent(gap, most),
            reason=outlook.reason,
        )


def _percent(gap: float | None, most: float | None) -> float | None:
    if gap is None or most is None:
        return None
    return 100 * gap / most if most > 0 else 0.0
