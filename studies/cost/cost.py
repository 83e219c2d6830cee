"""Cost of a topology: by formula, counted in the running system, and timed.

The formulas (Eq. 18-23) count the operations of a sweep over all states, while the running system
visits one state a step. They share two numbers, which are counted and compared: the joint actions
that each agent tries, ``|A| ** (1 + |below|)``, and the rules that value each of them.

In a coordination graph an agent tries joint actions of itself and its neighbors, and the team
decides by variable elimination, whose own operations are timed but not counted. Some ways to decide
(`WAYS`) replace a topology: they try few of all joint actions.

Counting and timing use the line-up scenario, because its prediction costs next to nothing, and
sigmoid membership functions, because every rule of theirs fires.
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
from ...core.decision.settings import DecisionSettings
from ...core.evaluators.best_response import CUTS
from ...core.evaluators.coordination import MaxPlusSettings
from ...core.hierarchy.hierarchy import Hierarchy
from ...core.interface.agents import Counts
from ...core.interface.scenario import Scenario
from ...core.learners.td import TDLambdaSettings
from ...core.rules.rule_base import RuleBaseSettings
from ...scenarios.line_up import LineUp, LineUpSettings
from ...topologies import build, parse
from ..results.statistics import NOT_NEGATIVE, Estimate, bootstrap

SINGLE_AGENT = "single-agent"
"""Name that replaces a topology for the single agent of Eq. 23."""
MEMBERSHIPS = 5
PAPER = Problem()
"""|S|, |A| and L of the paper's experiment."""
RULES = MEMBERSHIPS**2
"""|S| of an agent that is counted and timed."""
ACTIONS = 4
"""|A| of an agent that is counted and timed."""
LEARNER = TDLambdaSettings(
    rule_base=RuleBaseSettings(membership="sigmoid", memberships=MEMBERSHIPS, order=2),
    decision=DecisionSettings(rule="value", evaluator="exact"),
)
"""The learner that is counted and timed: the paper's, over the two variables of line-up."""


def _around_a_plan(n: int, actions: int) -> list[int]:
    cuts = {round(share * n) for share in CUTS} - {0, n}
    starts = actions + len(cuts) * actions * (actions - 1)
    return [starts + (n + 1) * actions] + [actions] * (n - 1)


WAYS: dict[str, tuple[str, Callable[[int, int], list[int]] | None]] = {
    # The first agent of a chain plans for all and hands its plan down.
    "best-response": ("chain", _around_a_plan),
    "max-plus": ("coordination-graph", None),
    # Forward passes without a prediction: an agent values its actions, or draws one.
    "fitted-q": ("chain", lambda n, actions: [actions] * n),
    "hierarchy-ppo": ("chain", lambda n, actions: [1] * n),
}
"""Ways to decide that stand in place of a topology: that by which they are told, and how many joint
actions each of n agents tries that has so many actions; none: all of those that it considers."""
PASSES = ("fitted-q", "hierarchy-ppo")
"""Those of them that are not counted and timed."""
MOST_OPERATIONS = 4 * 10**8
"""Rule evaluations a step beyond which nothing is measured: about a second a step."""
LEAST_SECONDS = 0.3
"""How long each repeat is timed at least [s]."""
MOST_TIMES = 100
"""How often each repeat is timed at most."""


@dataclass(frozen=True)
class StepCost:
    """Cost of one step of the running system."""

    counted: Counts
    """Counts of the whole team."""
    deciding: float
    """Median time of a decision [s]."""
    learning: float
    """Median time of learning from a step [s]."""
    memory: int
    """Peak memory of team and step [bytes]."""
    repeats: tuple[float, ...]
    """Time of a step in each repeat, each with a new team [s]."""

    @property
    def step(self) -> Estimate:
        """Mean time of a step over repeats with its 95% interval [s]; one repeat has none."""
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
    """Eq. 18; none for the single agent."""
    nested_closed_form: int | None
    """Eq. 19; none unless the topology is a chain."""
    nested_asymptotic: Fraction | None
    """Eq. 21; none unless the topology is a chain."""
    single_agent: int
    """Eq. 23."""
    memberships: int | None = None
    """Membership functions of each state variable, if they determine the rules."""
    formula: Counts | None = None
    """Counts of a step of the whole team by the formulas, if a measurement was requested."""
    measured: StepCost | None = None
    network: tuple[int, int] | None = None
    """If requested, the messages of a decision, and how many of them follow one another."""
    broadcast: int = 0
    """States that agents send to others besides these messages."""
    free: int = 0
    """Maximum number of agents over which one agent searches, itself included; 0 for `WAYS`."""

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
    """Return how many joint actions each of n agents tries in a decision."""
    topology, tried = WAYS.get(text, (text, None))
    if tried is not None:
        return tried(n, actions)
    return [actions ** (1 + below) for below in agents_below(topology, n)]


def messages(text: str, n: int) -> tuple[int, int]:
    """Return how many messages a decision of n agents takes, and how many follow one another.

    A single agent hears all others and tells them. In a chain everybody is told by all above. To
    eliminate variables each hands a table to the next, and hears what is best; by max-plus
    neighbours tell each other in every round, of which are at most 100.
    """
    if text == SINGLE_AGENT:
        return 2 * (n - 1), 2 * (n > 1)
    hierarchy = _hierarchy(WAYS.get(text, (text,))[0], n)
    if not hierarchy.neighbors:
        return hierarchy.n_messages, hierarchy.depth - 1
    rounds = MaxPlusSettings().rounds
    return (rounds * hierarchy.n_messages, rounds) if text == "max-plus" else (2 * n - 2, 2 * n - 2)


def broadcasts(text: str, n: int) -> int:
    """Return how many states are sent to agents before a decision, beside its messages.

    Each agent sends its own to all others, from which they predict. A single agent is told states
    by the messages that it hears.
    """
    return 0 if text == SINGLE_AGENT else n * (n - 1)


def _hierarchy(text: str, n: int) -> Hierarchy:
    return build(text, [f"agent{i + 1}" for i in range(n)], pairs(n))


def agents_below(text: str, n: int) -> Sequence[int]:
    """Return how many agents are below each of n agents in the topology written as `text`.

    Raises
    ------
    ValueError
        If the topology is refused.
    """
    if text in ("chain", "chain:reversed", "chain:interleaved"):
        return range(n)  # a thousand hierarchies of a thousand agents take their time
    return below_counts(_hierarchy(text, n))


def pairs(n: int) -> tuple[tuple[int, ...], ...]:
    """Return n agents as robots of two wheels; of an odd number, the last has one.

    Examples
    --------
    >>> pairs(5)
    ((0, 1), (2, 3), (4,))
    """
    return tuple(tuple(range(i, min(i + 2, n))) for i in range(0, n, 2))


def step_formula(text: str, n: int) -> Counts:
    """Return what a step of the running system comes to by the formulas, for the whole team."""
    if text == SINGLE_AGENT:
        return Counts(ACTIONS**n, (ACTIONS * RULES) ** n, RULES**n)
    joint = sum(joint_actions(text, n, ACTIONS))
    return Counts(joint, joint * RULES, n * RULES)


def measure(text: str, n: int, repeats: int = 1) -> StepCost | None:
    """Count and time a step of n agents; none where it would take too long or too much memory."""
    if text in PASSES or step_formula(text, n).rule_evaluations > MOST_OPERATIONS:
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
    # An episode here has two steps, of which the second alone changes weights.
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
    """Take steps until enough time has been measured; return (deciding, learning) [s] of each."""
    times = [_step(team, scenario)]
    while sum(map(sum, times)) < LEAST_SECONDS and len(times) < MOST_TIMES:
        times.append(_step(team, scenario))
    return times


def _arrange(text: str, line_up: LineUp) -> tuple[TDLambdaSettings, Scenario, Hierarchy]:
    """Return the learner of a topology over line-up, what it acts in, and the hierarchy."""
    n = len(line_up.agents)
    if text == SINGLE_AGENT:
        scenario = join_agents(line_up, "team")
        base = LEARNER.rule_base.model_copy(update={"order": 2 * n})
        learner = LEARNER.model_copy(update={"rule_base": base})
        return learner, scenario, Hierarchy(scenario.agents, [])
    settings = parse(WAYS.get(text, (text,))[0])
    hierarchy = build(settings, line_up.agents, pairs(n))
    usual = "variable-elimination" if settings.kind == "coordination-graph" else "exact"
    evaluator = text if text in WAYS else usual
    if settings.kind == "coordination-graph" and not hierarchy.neighbors:
        evaluator = "exact"  # a single agent has no neighbors
    decision = DecisionSettings(rule="value", evaluator=evaluator)
    return LEARNER.model_copy(update={"decision": decision}), line_up, hierarchy


@cache
def _warm_up() -> None:
    """Have everything imported and compiled before memory is traced and time taken."""
    line_up = LineUpSettings(carts=2).build()
    for topology in ("chain", "independent"):
        hierarchy = build(topology, line_up.agents)
        _step(Team(LEARNER, line_up, hierarchy, policy_seed(0)), line_up)


def _step(team: Team, scenario: Scenario) -> tuple[float, float]:
    """Take a step from a fresh start; return (deciding, learning) [s].

    It is the second step of an episode: in the first, the learner has nothing to look back on.
    """
    _, record = control_loop(scenario, team, episodes=1, steps=2, seed=0)
    return record.deciding, record.learning
