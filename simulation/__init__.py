"""What policies earn: the belief process, simulated.

Knows policies and beliefs, and nothing of a service.
"""

from simulation.contender import Contender, contenders
from simulation.course import Course, slots_of
from simulation.effort import seconds
from simulation.value import Value, remainder, standard_error, value

__all__ = [
    "Contender",
    "Course",
    "Value",
    "contenders",
    "remainder",
    "seconds",
    "slots_of",
    "standard_error",
    "value",
]
