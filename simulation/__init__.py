"""What policies earn: the belief process, simulated.

Knows policies and beliefs, and nothing of a service.
"""

from simulation.contender import (
    Contender,
    Progress,
    contenders,
    table_discounts,
)
from simulation.course import Course, slots_of
from simulation.effort import seconds
from simulation.examples import Example, drawn, example, ordered
from simulation.listeners import Listeners
from simulation.opening import opening
from simulation.value import Value, half_width, remainder, standard_error, value

__all__ = [
    "Contender",
    "Course",
    "Example",
    "Listeners",
    "Progress",
    "Value",
    "contenders",
    "drawn",
    "example",
    "half_width",
    "opening",
    "ordered",
    "remainder",
    "seconds",
    "slots_of",
    "standard_error",
    "table_discounts",
    "value",
]
