"""How much any policy can earn from a new user at most, and one item alone."""

from dataclasses import dataclass

from app.errors import Fault, TooLargeToBound
from app.services import openings
from app.services.index_builds import in_use
from app.services.live import Live
from app.services.openings import Opening
from app.storage import revision
from app.storage.store import Store
from policies import Bound, Effort, bound, effort, worth_for_ever

FINEST, COARSEST = 12_500, 100  # points of a grid
MOODY = (
    "The models have a mood, which ties the items together: what bounds each of them by"
    " itself bounds nothing."
)
MOVE = 6e-8  # seconds to follow a move, times the slots that count, at all prices
LEAF = 1.5e-5  # seconds for a leaf, at all prices


@dataclass(frozen=True, slots=True)
class Limits:
    """How much a bound may take.

    moves:  of all grids, times the slots that count at the discount
    leaves: of the look-ahead, at each price
    """

    moves: float
    leaves: float


OF_A_REQUEST = Limits(moves=1e8, leaves=3e5)  # seconds
OF_A_COMMAND = Limits(moves=3e9, leaves=3e7)  # minutes


@dataclass(frozen=True, slots=True)
class Fixed:
    """What playing an item of one model for ever earns: the most of all models."""

    model: str
    value: float


@dataclass(frozen=True, slots=True)
class Outlook:
    """Between what one item earns and what no policy exceeds.

    bound:  certified; found at a price of rest
    reason: why there is neither
    """

    opening: Opening
    discount: float
    depth: int
    bound: Bound | None
    best_fixed: Fixed | None
    reason: str | None = None


def outlook(store: Store, live: Live, discount: float | None, depth: int) -> Outlook:
    """That of the present catalogue, at the discount in use if none is given."""
    known = revision.current(store)
    catalogue = live.catalogue(store, known)
    worth = in_use(store, known)[0].discount if discount is None else discount

    def look() -> Outlook:
        opening = openings.of_catalogue(catalogue)
        if opening.is_moody:
            return Outlook(opening, worth, depth, None, None, MOODY)
        return Outlook(
            opening,
            worth,
            depth,
            certified(opening, worth, depth, OF_A_REQUEST),
            best_fixed(opening, worth),
        )

    return store.in_turn(look)


def certified(opening: Opening, discount: float, depth: int, limits: Limits) -> Bound:
    """The bound on the finest grids that keep within the limits."""
    points, _ = _fitting(opening, discount, depth, limits)
    return bound(opening.situation, discount, depth, points)


def expected_seconds(
    opening: Opening, discount: float, depth: int, limits: Limits
) -> float:
    """Roughly what that takes."""
    _, needed = _fitting(opening, discount, depth, limits)
    return MOVE * needed.moves / (1 - discount) + LEAF * needed.leaves


def _fitting(
    opening: Opening, discount: float, depth: int, limits: Limits
) -> tuple[int, Effort]:
    points, moves = FINEST, limits.moves * (1 - discount)
    needed = effort(opening.situation, depth, points)
    if needed.leaves > limits.leaves:
        fault = Fault("depth", f"too deep for {len(opening.models)} models", depth)
        raise TooLargeToBound("The look-ahead has too many branches.", fault)
    while needed.moves > moves and points > COARSEST:
        points = max(points // 2, COARSEST)
        needed = effort(opening.situation, depth, points)
    if needed.moves > moves:
        fault = Fault("discount", f"too long a view for {len(opening.models)} models")
        raise TooLargeToBound("The models have too many states in all.", fault)
    return points, needed


def best_fixed(opening: Opening, discount: float) -> Fixed:
    """The best item to play for ever, by its closed form."""
    worth = worth_for_ever(opening.situation, discount)
    best = int(worth.argmax())
    return Fixed(opening.models[best], float(worth[best]))
