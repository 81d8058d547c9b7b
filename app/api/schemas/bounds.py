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
    bound: Annotated[float, Field(description="what no policy exceeds on average")]
    price: Annotated[float, Field(description="of a slot of rest, at the bound")]
    best_fixed: FixedView
    gap: Annotated[float, Field(description="from the best fixed item to the bound")]
    gap_percent: Annotated[float, Field(description="of the bound")]

    @classmethod
    def of(cls, outlook: Outlook) -> Self:
        most, fixed = outlook.bound.value, outlook.best_fixed
        gap = max(most - fixed.value, 0.0)
        return cls(
            discount=outlook.discount,
            depth=outlook.depth,
            models=len(outlook.opening.models),
            items=sum(outlook.opening.items),
            bound=most,
            price=outlook.bound.price,
            best_fixed=FixedView(model=fixed.model, value=fixed.value),
            gap=gap,
            gap_percent=100 * gap / most if most > 0 else 0.0,
        )
