"""Parts of agents: learned models, coordination graphs, costs and private signals."""

from .core.adaptation.calibration import CalibrationSettings
from .core.adaptation.self_model import SelfModelSettings
from .core.agents.cost import PAPER_ACTIONS, Problem, below_counts
from .core.coordination.graphs import Elimination, MaxPlus, Scope
from .core.interface.experience import Experience
from .core.interface.prediction import EmbodiedPrediction
from .core.learners import LEARNERS
from .scenarios.matrix_games.plays import whole_episode
from .scenarios.signals.bayesian import Bayesian
from .scenarios.signals.scenario import SignalsSettings
from .scenarios.signals.theory import cascade, expected, majority

__all__ = [
    "LEARNERS",
    "PAPER_ACTIONS",
    "Bayesian",
    "CalibrationSettings",
    "Elimination",
    "EmbodiedPrediction",
    "Experience",
    "MaxPlus",
    "Problem",
    "Scope",
    "SelfModelSettings",
    "SignalsSettings",
    "below_counts",
    "cascade",
    "expected",
    "majority",
    "whole_episode",
]
