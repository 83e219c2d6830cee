"""The four labs and their questions.

Their programs stand beside this file, one for each. What is right is computed here where a
formula says it; what a program measures is right within bounds that any two machines keep.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from nested_agents import build_hierarchy as build
from nested_agents.parts import Problem, below_counts

from questions import Choice, Edges, Numeric, Question

WHEELS = tuple(f"robot{robot}.{side}" for robot in (1, 2, 3, 4) for side in ("left", "right"))


@dataclass(frozen=True)
class Lab:
    """One lab."""

    title: str
    """What it is about."""
    questions: Mapping[str, Question]
    """By the key of the answer."""


def _tried(topology: str, agents: int) -> int:
    """Return how many joint actions of four actions each a decision tries."""
    names = [f"agent{i + 1}" for i in range(agents)]
    return Problem(actions=4).decision(below_counts(build(topology, names)))


CLIMBING_GAME = Lab(
    "The climbing game: what nesting buys",
    {
        "optimum": Numeric(
            "What are both agents paid for the best joint action of the game?", 11,
            hint="look for the greatest payment of the table",
        ),
        "expected": Numeric(
            "While the second agent plays a, b and c equally often, what is action a of the first"
            " one worth on average?", (11 - 30 + 0) / 3, 0.05,
            hint="average the first line of the table",
        ),
        "first": Choice(
            "Which action does a first agent prefer that averages so?",
            {"a": "a", "b": "b", "c": "c"}, "c",
            hint="average the other two lines, too",
        ),
        "nested": Numeric(
            "In which share of climbing games does 'nested, maximum' end at the optimum?", 1.0,
            0.05, hint="read the line 'nested, maximum' of the table of climbing",
        ),
        "averaging": Numeric(
            "And 'nested, observed', which passes decisions down, too?", 0.0, 0.05,
            hint="read the line 'nested, observed' of the table of climbing",
        ),
        "reason": Choice(
            "Why does 'nested, observed' miss the optimum, though the second agent is told what the"
            " first one plays?",
            {
                "a": "It explores too little.",
                "b": "The first agent expects what the second one did so far, not what it would"
                " do once it is told.",
                "c": "The second agent does not know the payments.",
            }, "b",
            hint="ask what the first agent knows when it decides",
        ),
        "values": Numeric(
            "Nesting has a price. How many joint actions does each of five agents with three"
            " actions have to value?", 3**5,
            hint="the actions of all agents are combined",
        ),
    },
)  # fmt: skip

COSTS = Lab(
    "What a chain, a tree and a graph cost",
    {
        "chain": Numeric(
            "How many joint actions does a decision of a chain of eight agents try?",
            _tried("chain", 8), hint="add 4 ** (1 + below) over the agents",
        ),
        "tree": Numeric(
            "And of a binary tree of eight agents?", _tried("tree:2", 8),
            hint="print the line of tree:2 with eight agents",
        ),
        "graph": Numeric(
            "And of a coordination graph that is a line of eight?",
            _tried("coordination-graph", 8),
            hint="an agent of a line has one neighbor or two",
        ),
        "factor": Numeric(
            "By which factor does one more agent multiply the work of a long chain?", 4, 0.1,
            hint="divide the joint actions of nine agents by those of eight",
        ),
        "step": Numeric(
            "How many joint actions does one more agent add to a long line?", 4**3,
            hint="the new agent is an end; the old end has now two neighbors",
        ),
        "width": Choice(
            "Variable elimination is exact. What decides whether it can be afforded?",
            {
                "a": "the number of agents",
                "b": "the number of edges",
                "c": "the width of the graph in the order of elimination",
            }, "c",
            hint="think of a line of a thousand agents, and of ten who are all neighbors",
        ),
    },
)  # fmt: skip

WHEEL_FAILURE = Lab(
    "A wheel fails",
    {
        "episode": Numeric(
            "Episodes are counted from 0. In which episode does the wheel begin to fail?", 10,
            hint="read the table scenario.failures of the spec",
        ),
        "told": Choice(
            "Who tells the agents that the wheel has failed?",
            {"a": "the simulator", "b": "the robot's other wheels", "c": "nobody"}, "c",
            hint="read what agents perceive in the page of worlds",
        ),
        "notices": Choice(
            "What does a self-model compare?",
            {
                "a": "the motion that was predicted with the motion that was seen",
                "b": "the reward that was predicted with the reward that was paid",
                "c": "one robot with the other",
            }, "a",
            hint="it learns what its wheels do to the motion of the robot",
        ),
        "better": Choice(
            "Which of the teams keeps more of its success after the failure?",
            {"a": "weights alone", "b": "weights and self-model", "c": "nothing adapts"}, "b",
            hint="compare the lines of the figure to the right of the failure",
        ),
        "fair": Choice(
            "Why does the same team run on, without learning, beside the learning one?",
            {
                "a": "It shows what the failure costs if nothing adapts.",
                "b": "It makes the intervals shorter.",
                "c": "It saves time.",
            }, "a",
            hint="without it, nobody knows how much of the success was learned anew",
        ),
    },
)  # fmt: skip

OWN_HIERARCHY = Lab(
    "Your own hierarchy",
    {
        "chain": Numeric(
            "How many joint actions does a decision of the four wheels of two e-Pucks try in a"
            " chain?", _tried("chain", 4),
            hint="run ./dev exec nested-agents topology show chain --robots 2",
        ),
        "independent": Numeric(
            "And if nobody sees anybody?", _tried("independent", 4),
            hint="each agent tries its own four actions",
        ),
        "seeds": Numeric(
            "With how many seeds can one comparison reach p < 0.05 at all? The test flips the signs"
            " of n differences, so p is a multiple of 2 ** (1 - n).", 6,
            hint="find the least n with 2 ** (1 - n) < 0.05",
        ),
        "absent": Choice(
            "A comparison of six seeds ends with 'no significant difference'. What does it say?",
            {
                "a": "The hierarchies are equally good.",
                "b": "A difference as large as the ends of the interval may remain.",
                "c": "The study was faulty.",
            }, "b",
            hint="look at how wide the interval is",
        ),
        "edges": Edges(
            "Write a hierarchy of the eight wheels of four e-Pucks. All hang together, one wheel of"
            " each robot is above the other, and a decision tries at most 400 joint actions.",
            WHEELS, 400,
            hint="who is below costs a factor of four, and those below them count, too",
        ),
    },
)  # fmt: skip

LABS: dict[str, Lab] = {
    "climbing-game": CLIMBING_GAME,
    "costs": COSTS,
    "wheel-failure": WHEEL_FAILURE,
    "own-hierarchy": OWN_HIERARCHY,
}
"""The labs of the course in their order."""
