"""Models from logs of plays: learned, proved on held-out plays, and compared.

A log says who was played what, when, and what came of it. `Plays` holds one; chains
are learned from it by expectation and maximisation.
"""

from learning.plays import NONE, Bools, Plays
from policies import Floats

__all__ = ["NONE", "Bools", "Floats", "Plays"]
