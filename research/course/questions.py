"""Kinds of questions that a computer can grade: numbers, choices, and hierarchies.

A question refuses an answer that is none (a word where a number belongs) by `ValueError`, and tells
of every other answer whether it is right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import networkx as nx

from nested_agents import Hierarchy
from nested_agents.parts import PAPER_ACTIONS, Problem, below_counts


class Question(Protocol):
    """One question of a lab."""

    @property
    def text(self) -> str:
        """What is asked."""
        ...

    @property
    def hint(self) -> str:
        """Where to look, for those who answered wrongly."""
        ...

    @property
    def form(self) -> str:
        """What an answer looks like, in words."""
        ...

    def is_right(self, answer: Any) -> bool:
        """Tell whether an answer is right.

        Raises
        ------
        ValueError
            If it is no answer; the message says what one is.
        """
        ...


@dataclass(frozen=True)
class Numeric:
    """A number, right between two bounds.

    Examples
    --------
    >>> Numeric("How many wheels have two e-Pucks?", 4).is_right(4.0)
    True
    """

    text: str
    answer: float
    tolerance: float = 0.0
    hint: str = ""

    form = "a number"

    def is_right(self, answer: Any) -> bool:
        """Tell whether a number is near enough."""
        if isinstance(answer, bool) or not isinstance(answer, int | float):
            raise ValueError("must be a number")
        return abs(answer - self.answer) <= self.tolerance


@dataclass(frozen=True)
class Choice:
    """One of several options, named by letters."""

    text: str
    options: Mapping[str, str]
    right: str
    hint: str = ""

    @property
    def form(self) -> str:
        """The options, a line each."""
        return "\n".join(f"{letter}) {option}" for letter, option in self.options.items())

    def is_right(self, answer: Any) -> bool:
        """Tell whether the letter is that of the right option."""
        if answer not in tuple(self.options):
            raise ValueError(f"must be one of {', '.join(self.options)}")
        return bool(answer == self.right)


@dataclass(frozen=True)
class Edges:
    """A hierarchy of one's own, as pairs (superior, subordinate), within a budget.

    It is right if it is connected, if one of any two wheels of a robot is above the other, and if a
    decision tries at most so many joint actions. Pairs are data, so that grading runs no code of
    anybody.
    """

    text: str
    agents: tuple[str, ...]
    """Their names, ``robot.wheel``."""
    most: int
    """Joint actions that a decision of the team may try."""
    hint: str = ""
    problem: Problem = field(default_factory=lambda: Problem(actions=PAPER_ACTIONS))

    form = 'pairs, such as [["robot1.left", "robot1.right"], ["robot2.left", "robot2.right"]]'

    def is_right(self, answer: Any) -> bool:
        """Tell whether a list of pairs is such a hierarchy."""
        pairs = answer if isinstance(answer, list | tuple) else None
        if pairs is None or not all(isinstance(p, list | tuple) and len(p) == 2 for p in pairs):
            raise ValueError("must be a list of pairs of names")
        hierarchy = Hierarchy(self.agents, pairs)
        graph = nx.Graph(hierarchy.edges)
        graph.add_nodes_from(range(len(self.agents)))
        related = [
            j in hierarchy.searched(i) or i in hierarchy.searched(j)
            for i, one in enumerate(self.agents)
            for j, other in enumerate(self.agents)
            if i < j and one.partition(".")[0] == other.partition(".")[0]
        ]
        tried = self.problem.decision(below_counts(hierarchy))
        return bool(nx.is_connected(graph) and all(related) and tried <= self.most)
