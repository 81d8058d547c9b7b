"""What is believed if one sample of a model is the true one."""

import numpy as np

from policies.arrays import Floats, Ints
from policies.bayes import IMPOSSIBLE
from policies.compiled import compiled
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
    for k in range(draws):
        for g in range(len(model)):
            samples = models.samples[model[g]]
            size = models.states[model[g]] // samples
            first, last = k % samples * size, (k % samples + 1) * size
            if _mass(belief, g, first, last) < IMPOSSIBLE:
                first, last = 0, samples * size
            mass = _mass(belief, g, first, last) if samples > 1 else 1.0
            for i in range(first, last):
                found[k, g, i % size] += belief[g, i] / mass
    return found


@compiled
def _mass(belief: Floats, g: int, first: int, last: int) -> float:
    total = 0.0
    for i in range(first, last):
        total += belief[g, i]
    return total
