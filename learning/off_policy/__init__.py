"""What another policy would have earned, of a log that tells how plays were chosen.

A log whose arms were chosen with known chances is an experiment that was run once and
answers for every policy that it could have followed by luck. Where it cannot answer, it
says why.

The answers are for one step: the other policy chooses one play, in the situations in
which the log's policy put the users. But beliefs move: a policy that were followed for
long would meet other situations. What it would earn after some plays of its own is
answered too (`Rules.in_a_row`), and with each play in a row fewer of the log's count.
"""

from learning.off_policy.cannot import CannotAnswer, Reason
from learning.off_policy.catalogue import Catalogue, catalogue, learned
from learning.off_policy.evaluation import evaluate
from learning.off_policy.report import Report
from learning.off_policy.rules import Rules

__all__ = [
    "CannotAnswer",
    "Catalogue",
    "Reason",
    "Report",
    "Rules",
    "catalogue",
    "evaluate",
    "learned",
]
