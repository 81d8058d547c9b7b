"""What is believed if one sample of a model is the true one."""

import numpy as np

from policies.arrays import Floats, Ints
from policies.bayes import IMPOSSIBLE
from policies.compiled import compiled, inner
from policies.model_set import ModelSet


@compiled
def conditioned(
    models: ModelSet, model: Ints, belief: Floats, draws: int, states: int
) -> Floats:
    """Return (D, G, T): the beliefs about the state in each of D samples of a model.

    Draw k stands for sample k of every model, or k modulo their number. That is the
    belief over pairs, limited to the pairs of this sample and normalised. A sample that
    the answers have ruled out (they had no chance, below 2.2e-308) has no belief of its
    own left: it takes the one about the state that all samples have together, which has
    moved with the slots and answers and is nearer than the sample's prior.

    Args:
        models: M models of S states.
        model: (G,) row of each belief's model.
        belief: (G, S).
        draws: D.
        states: T, most states of a sample.
    """
    found = np.zeros((draws, len(model), states))
    for g in range(len(model)):
        samples = models.samples[model[g]]
        size = models.states[model[g]] // samples
        for k in range(draws):
            first = k % samples * size
            for i in range(first, first + size):
                found[k, g, i - first] = belief[g, i]
            if samples > 1 and not _normalise(found, k, g):
                for i in range(samples * size):
                    found[k, g, i % size] += belief[g, i]
                _normalise(found, k, g)
    return found


@inner
def _normalise(beliefs: Floats, k: int, g: int) -> bool:
    """Divide a row by its sum; say whether it has one, else write zeros."""
    total = 0.0
    for i in range(beliefs.shape[2]):
        total += beliefs[k, g, i]
    possible = total >= IMPOSSIBLE
    for i in range(beliefs.shape[2]):
        beliefs[k, g, i] = beliefs[k, g, i] / total if possible else 0.0
    return possible
