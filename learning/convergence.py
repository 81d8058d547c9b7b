"""Whether chains of draws have forgotten where they began."""

import numpy as np

from policies import Floats

FEWEST = 4  # draws of half a chain that tell anything


def r_hat(draws: Floats) -> float:
    """Return how much wider draws of all chains are than those of one.

    Gelman and Rubin (1992), with chains cut in two; about 1 if all tell the same.

    Args:
        draws: (C, N) of one quantity.
    """
    half = draws.shape[1] // 2
    if half < FEWEST:
        return float("nan")
    parts = np.concatenate((draws[:, :half], draws[:, -half:]))
    within = parts.var(axis=1, ddof=1).mean()
    between = parts.mean(axis=1).var(ddof=1)
    if within == 0:
        return 1.0
    return float(np.sqrt((half - 1) / half + between / within))


def effective(draws: Floats) -> float:
    """Return how many independent draws are worth as much (Geyer 1992).

    Autocorrelations are added up in pairs, as long as these are positive.

    Args:
        draws: (C, N) of one quantity.
    """
    chains, count = draws.shape
    apart = draws - draws.mean(axis=1, keepdims=True)
    within = float((apart**2).sum() / (chains * (count - 1)))
    total = (count - 1) / count * within
    total += float(draws.mean(axis=1).var(ddof=1)) if chains > 1 else 0.0
    if total == 0:
        return float(chains * count)
    correlation = np.array(
        [
            1 - (within - (apart[:, lag:] * apart[:, : count - lag]).sum()
                 / (chains * count)) / total
            for lag in range(count)
        ]
    )  # fmt: skip
    pairs = correlation[: count // 2 * 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0)
    some = pairs[: ends[0]] if len(ends) else pairs
    time = max(
        2 * float(np.minimum.accumulate(some).sum()) - 1, 1 / np.log10(10 + count)
    )
    return float(min(chains * count / time, chains * count))
