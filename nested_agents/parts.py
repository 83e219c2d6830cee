"""Parts of agents: learned models, coordination graphs and costs."""

from .core.agents.cost import PAPER_ACTIONS, Problem, below_counts
from .core.interface.experience import Experience
from .core.interface.prediction import EmbodiedPrediction
from .core.learners import LEARNERS
from .core.models.calibration import CalibrationSettings
from .core.models.self_model import SelfModelSettings
from .core.search.coordination_graphs import Elimination, MaxPlus, Scope

__all__ = [
    "LEARNERS",
    "PAPER_ACTIONS",
    "CalibrationSettings",
    "Elimination",
    "EmbodiedPrediction",
    "Experience",
    "MaxPlus",
    "Problem",
    "Scope",
    "SelfModelSettings",
    "below_counts",
]
