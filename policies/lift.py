"""What the present mood adds to the play of an item.

Indices and prices are of models in their mean mood. The next play is in a mood that is
known: an item earns more or less by what its mood makes of the reward. That is exact if
the mood lasts for one play, and leaves out what the answer does to later moods.
"""

from policies.arrays import Floats
from policies.bayes import expected_like
from policies.situation import Situation


def lifted(scores: Floats, situation: Situation) -> Floats:
    """Return (G,) scores, of the mean mood, with the reward of the present one."""
    models = situation.models
    if models.classes == 1:
        return scores
    now = expected_like(models.like_in, situation.chances, situation.belief)
    usual = expected_like(models.like, situation.model, situation.belief)
    return scores + (now - usual)
