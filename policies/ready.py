"""Making a policy ready to decide."""

from policies.index_table import MOST_POINTS
from policies.model_set import ModelSet
from policies.policy import Policy, Scorer
from policies.tables import build_all


def ready(policy: Policy, models: ModelSet, most_points: int = MOST_POINTS) -> Scorer:
    """Build the index tables that a policy needs, half a second each, and prepare it.

    Where tables are kept, give them to `Policy.prepare` instead. Grids of few points
    make rough tables, quickly.
    """
    tables = build_all(models.separated(), policy.table_discount, most_points)
    return policy.prepare(models, tables)
