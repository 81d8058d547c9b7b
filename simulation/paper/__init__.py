"""The paper, reproduced and corrected.

Meshram and Kaza (2021), "Monte Carlo Rollout Policy for Recommendation Systems with
Dynamic User Behavior", arXiv:2102.04321. `parts` simulates, `claims` judges what the
paper says by what was found, `figures` draws, `report` writes.
"""

from simulation.paper.claims import Claim, claims
from simulation.paper.parts import PARTS, Scale
from simulation.paper.rows import Part, Row

__all__ = ["PARTS", "Claim", "Part", "Row", "Scale", "claims"]
