"""Making a policy ready to decide."""

from policies.model_set import ModelSet
from policies.policy import Policy, Scorer
from policies.tables import build_all


def ready(policy: Policy, models: ModelSet) -> Scorer:
    """Build the index tables that a policy needs, half a second each, and prepare it.

    Where tables are kept, give them to `Policy.prepare` instead.
    """
    tables = build_all(models.separated(), policy.table_discount)
    return policy.prepare(models, tables)
