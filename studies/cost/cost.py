"""Cost of a topology: by formula, counted in the running system, and timed.

The formulas (Eq. 18-23) count the operations of a sweep over all states, while the running system
visits one state per step. Both depend on the number of joint actions that each agent tries,
``|A| ** (1 + |below|)``, and on the number of rules that evaluate each of them. These two numbers
are counted and compared.

In a coordination graph, an agent tries the joint actions of itself and its neighbors. The
operations of variable elimination are timed but not counted. Some `DECISION_METHODS` replace a
topology and try few joint actions.

Counts and times use the line-up scenario, because its prediction costs very little, with sigmoid
membership functions, because all of their rules fire.
"""

import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from fractions import Fraction
from functools import cache
from itertools import chain
from statistics import median

from ...core.agents.cost import Problem, below_counts
from ...core.agents.joint import join_agents
from ...core.agents.loop import control_loop, policy_seed
from ...core.agents.team import Team
from ...core.hierarchy.hierarchy import Hierarchy
from ...core.interface.agents import Counts
from ...core.interface.scenario import Scenario
from ...core.learners.td import TDLambdaSettings
from ...core.search.best_response import CUTS
from ...core.search.coordination import MaxPlusSettings
from ...core.search.settings import DecisionSettings
from ...core.values.rule_base import RuleBaseSettings
from ...scenarios.line_up import LineUp, LineUpSettings
from ...topologies import build, parse
from ..results.statistics import NOT_NEGATIVE, Estimate, bootstrap

SINGLE_AGENT = "single-agent"
"""Name of the single agent of Eq. 23, which replaces a topology."""
MEMBERSHIPS = 5
PAPER = Problem()
"""Quantities |S|, |A| and L of the paper's experiment."""
RULES = MEMBERSHIPS**2
"""Number of rules |S| of an agent in counts and times."""
ACTIONS = 4
"""Number of actions |A| of an agent in counts and times."""
LEARNER = TDLambdaSettings(
    rule_base=RuleBaseSettings(membership="sigmoid", memberships=MEMBERSHIPS, order=2),
    decision=DecisionSettings(rule="value", evaluator="exact"),
)
"""Learner in counts and times: that of the paper, over the two variables of line-up."""


def _best_response_counts(n: int, actions: int) -> list[int]:
    cuts = {round(share * n) for share in CUTS} - {0, n}
    starts = actions + len(cuts) * actions * (actions - 1)
    return [starts + (n + 1) * actions] + [actions] * (n - 1)


DECISION_METHODS: dict[str, tuple[str, Callable[[int, int], list[int]] | None]] = {
    # The first agent of a chain plans for all agents and communicates its plan.
    "best-response": ("chain", _best_response_counts),
    "max-plus": ("coordination-graph", None),
    # Forward passes without a prediction: values of the actions, or one sampled action.
    "fitted-q": ("chain", lambda n, actions: [actions] * n),
    "hierarchy-ppo": ("chain", lambda n, actions: [1] * n),
}
"""Decision methods that replace a topology: the topology of their communication, and a function of
the numbers of agents and actions that returns the joint actions each agent tries. None means all
joint actions in the agent's lookahead."""
MODEL_FREE = ("fitted-q", "hierarchy-ppo")
"""Decision methods without search, which are not counted and timed."""
MAX_OPERATIONS = 4 * 10**8
"""Maximum number of rule evaluations of a measured step, which take about a second."""
MIN_SECONDS = 0.3
"""Minimum time of each repeat [s]."""
MAX_STEPS = 100
"""Maximum number of steps of each repeat."""


@dataclass(frozen=True)
class StepCost:
    """Cost of one step of the running system."""

    counted: Counts
    """Counts of the whole team per step."""
    deciding: float
    """Median time of a decision [s]."""
    learning: float
    """Median time of learning from a step [s]."""
    memory: int
    """Peak memory of team and step [bytes]."""
    repeats: tuple[float, ...]
    """Time of a step in each repeat, with a new team each [s]."""

    @property
    def step(self) -> Estimate:
        """Mean time of a step [s] with its 95% interval if there are several repeats."""
        return bootstrap(self.repeats, bounds=NOT_NEGATIVE)


@dataclass(frozen=True)
class CostRow:
    """Cost of one topology over n agents."""

    agents: int
    topology: str
    """Label of the topology, or its text in a spec."""
    problem: Problem
    """Rules, actions and iterations of the formulas."""
    nested_exact: int | None
    """Operations by Eq. 18; None for the single agent."""
    nested_closed_form: int | None
    """Operations by Eq. 19; None unless the topology is a chain."""
    nested_asymptotic: Fraction | None
    """Operations by Eq. 21; None unless the topology is a chain."""
    single_agent: int
    """Operations by Eq. 23."""
    memberships: int | None = None
    """Membership functions of each state variable, if they determine the rules."""
    formula: Counts | None = None
    """Counts of a step of the whole team by the formulas, if a measurement was requested."""
    measured: StepCost | None = None
    network: tuple[int, int] | None = None
    """Numbers of messages of a decision and of those sent in sequence, if requested."""
    broadcast: int = 0
    """Number of states that agents broadcast in addition."""
    free: int = 0
    """Maximum number of agents in one search; 0 for `DECISION_METHODS`."""

    @property
    def by_formula(self) -> dict[str, int | Fraction | None]:
        """Results of the formulas by name."""
        return {
            "nested_exact": self.nested_exact,
            "nested_closed_form": self.nested_closed_form,
            "nested_asymptotic": self.nested_asymptotic,
            "single_agent": self.single_agent,
            "ratio": self.ratio,
        }

    @property
    def ratio(self) -> Fraction | None:
        """Cost of the single agent over that of the hierarchy."""
        return None if self.nested_exact is None else Fraction(self.single_agent, self.nested_exact)


def joint_actions(text: str, n: int, actions: int) -> list[int]:
    """Return the number of joint actions that each of n agents tries in a decision."""
    topology, tried = DECISION_METHODS.get(text, (text, None))
    if tried is not None:
        return tried(n, actions)
    return [actions ** (1 + below) for below in agents_below(topology, n)]


def messages(text: str, n: int) -> tuple[int, int]:
    """Return the number of messages of a decision, and of those sent one after another.

    A single agent collects the states of all others and sends their actions. In a chain each agent
    receives the actions of all above. Variable elimination passes a table from agent to agent and
    the best actions back. In max-plus, neighbors exchange messages in each round.
    """
    if text == SINGLE_AGENT:
        return 2 * (n - 1), 2 * (n > 1)
    hierarchy = _hierarchy(DECISION_METHODS.get(text, (text,))[0], n)
    if not hierarchy.neighbors:
        return hierarchy.n_messages, hierarchy.depth - 1
    rounds = MaxPlusSettings().rounds
    return (rounds * hierarchy.n_messages, rounds) if text == "max-plus" else (2 * n - 2, 2 * n - 2)


def broadcasts(text: str, n: int) -> int:
    """Return the number of states that agents send to all others before a decision.

    They are needed for predictions. The messages of a single agent include them.
    """
    return 0 if text == SINGLE_AGENT else n * (n - 1)


def _hierarchy(text: str, n: int) -> Hierarchy:
    return build(text, [f"agent{i + 1}" for i in range(n)], pairs(n))


def agents_below(text: str, n: int) -> Sequence[int]:
    """Return the number of agents below each of n agents in a topology.

    Raises
    ------
    ValueError
        If the topology is refused.
    """
    if text in ("chain", "chain:reversed", "chain:interleaved"):
        return range(n)  # building a thousand hierarchies of a thousand agents would be slow
    return below_counts(_hierarchy(text, n))


def pairs(n: int) -> tuple[tuple[int, ...], ...]:
    """Return n agents grouped as robots with two wheels; the last has one if n is odd.

    Examples
    --------
    >>> pairs(5)
    ((0, 1), (2, 3), (4,))
    """
    return tuple(tuple(range(i, min(i + 2, n))) for i in range(0, n, 2))


def step_formula(text: str, n: int) -> Counts:
    """Return the counts of a step of the whole team by the formulas."""
    if text == SINGLE_AGENT:
        return Counts(ACTIONS**n, (ACTIONS * RULES) ** n, RULES**n)
    joint = sum(joint_actions(text, n, ACTIONS))
    return Counts(joint, joint * RULES, n * RULES)


def measure(text: str, n: int, repeats: int = 1) -> StepCost | None:
    """Count and time a step of n agents; None if it would take too long."""
    if text in MODEL_FREE or step_formula(text, n).rule_evaluations > MAX_OPERATIONS:
        return None
    learner, scenario, hierarchy = _arrange(text, LineUpSettings(carts=n).build())
    _warm_up()
    tracemalloc.start()
    try:
        team = Team(learner, scenario, hierarchy, policy_seed(0))
        _step(team, scenario)
        memory = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    before = astuple(team.counts)
    times = [_time_steps(team, scenario)]
    # An episode has two steps, and only the second one updates weights.
    steps = 2 * len(times[0]), 2 * len(times[0]), len(times[0])
    after = astuple(team.counts)
    counted = (int(b - a) // n for a, b, n in zip(before, after, steps, strict=True))
    for seed in range(1, repeats):
        team = Team(learner, scenario, hierarchy, policy_seed(seed))
        _step(team, scenario)
        times.append(_time_steps(team, scenario))
    deciding, learning = (median(part) for part in zip(*chain(*times), strict=True))
    each = tuple(sum(map(median, zip(*taken, strict=True))) for taken in times)
    return StepCost(Counts(*counted), deciding, learning, memory, each)


def _time_steps(team: Team, scenario: Scenario) -> list[tuple[float, float]]:
    """Return the times (decision, learning) of steps until `MIN_SECONDS` have passed [s]."""
    times = [_step(team, scenario)]
    while sum(map(sum, times)) < MIN_SECONDS and len(times) < MAX_STEPS:
        times.append(_step(team, scenario))
    return times


def _arrange(text: str, line_up: LineUp) -> tuple[TDLambdaSettings, Scenario, Hierarchy]:
    """Return learner, scenario and hierarchy for a topology over line-up."""
    n = len(line_up.agents)
    if text == SINGLE_AGENT:
        scenario = join_agents(line_up, "team")
        base = LEARNER.rule_base.model_copy(update={"order": 2 * n})
        learner = LEARNER.model_copy(update={"rule_base": base})
        return learner, scenario, Hierarchy(scenario.agents, [])
    settings = parse(DECISION_METHODS.get(text, (text,))[0])
    hierarchy = build(settings, line_up.agents, pairs(n))
    usual = "variable-elimination" if settings.kind == "coordination-graph" else "exact"
    evaluator = text if text in DECISION_METHODS else usual
    if settings.kind == "coordination-graph" and not hierarchy.neighbors:
        evaluator = "exact"  # a single agent has no neighbors
    decision = DecisionSettings(rule="value", evaluator=evaluator)
    return LEARNER.model_copy(update={"decision": decision}), line_up, hierarchy


@cache
def _warm_up() -> None:
    """Import and compile everything before memory and time are measured."""
    line_up = LineUpSettings(carts=2).build()
    for topology in ("chain", "independent"):
        hierarchy = build(topology, line_up.agents)
        _step(Team(LEARNER, line_up, hierarchy, policy_seed(0)), line_up)


def _step(team: Team, scenario: Scenario) -> tuple[float, float]:
    """Return the times (decision, learning) of the second step of an episode [s].

    In the first step the learner has no previous state.
    """
    _, record = control_loop(scenario, team, episodes=1, steps=2, seed=0)
    return record.deciding, record.learning
