"""The values of an agent's own actions, over what the agents below it may do (Section V).

Agent i proposes each of its actions; the actions above are fixed, the unseen maintain, and the
joint actions of the agents below are tried. Their next states are predicted and valued, and the
values are gathered per own action: by their maximum, their mean, or their mean weighted with how
often the agents below were seen to act so. Evaluators differ in which joint actions they try.
"""

from .evaluator import Counts, Evaluator, Rule
from .exact import MOST_JOINT_ACTIONS, ExactEnumeration
from .latin_hypercube import LatinHypercube
from .sampling import Sampling
from .summed import Extremes, Moments

__all__ = [
    "MOST_JOINT_ACTIONS",
    "Counts",
    "Evaluator",
    "ExactEnumeration",
    "Extremes",
    "LatinHypercube",
    "Moments",
    "Rule",
    "Sampling",
]
