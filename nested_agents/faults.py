"""Faults of actuators for any Gymnasium environment and any PettingZoo parallel environment.

Seven faults, by actuator, from an episode and step to another; a wrapper for each library;
schedules from a seed; and the table of what they cost a policy, and how it comes back. The policy
is told nothing. Box pushing's wheels and the arm's joints fail by the same definitions.

Examples
--------
>>> import gymnasium
>>> from nested_agents import faults
>>> schedule = [faults.Weak(actuators=0, gain=0.5, episode=5, end_episode=10)]
>>> env = faults.FaultyEnv(gymnasium.make("Pendulum-v1"), schedule, inform=True)
>>> env.actuators
('0',)
"""

from .scenarios.faults.wrappers import (
    ActuatorFault,
    Delayed,
    FaultyEnv,
    FaultyParallelEnv,
    Free,
    Noisy,
    Reversed,
    Seized,
    Stuck,
    Weak,
)
from .studies.api.recovery import RandomPolicy, RecoveryTable, recovery_table

__all__ = [
    "ActuatorFault",
    "Delayed",
    "FaultyEnv",
    "FaultyParallelEnv",
    "Free",
    "Noisy",
    "RandomPolicy",
    "RecoveryTable",
    "Reversed",
    "Seized",
    "Stuck",
    "Weak",
    "recovery_table",
]
