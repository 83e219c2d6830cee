"""Parts of agents: learned models, coordination graphs and costs."""

from .core.adaptation.calibration import CalibrationSettings
from .core.adaptation.self_model import SelfModelSettings
from .core.agents.cost import PAPER_ACTIONS, Problem, below_counts
from .core.coordination.graphs import Elimination, MaxPlus, Scope
from .core.interface.experience import Experience
from .core.interface.prediction import EmbodiedPrediction
from .core.learners import LEARNERS

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
