"""Cost of a topology: by formula, within a budget, and measured in the running system.

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

from collections.abc import Callable, Sequence
from dataclasses import asdict, astuple, dataclass, field
from fractions import Fraction
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
from ...core.search.budget import divide
from ...core.search.coordination import MaxPlusSettings
from ...core.search.settings import DecisionSettings
from ...core.values.rule_base import RuleBaseSettings
from ...scenarios.line_up import LineUp, LineUpSettings
from ...topologies import build, parse

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
"""Minimum time of a measurement [s]."""
MAX_STEPS = 100
"""Maximum number of steps of a measurement."""


Columns = dict[str, float]
"""Values of a row by column; counts are exact integers."""


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
    free: int = 0
    """Maximum number of agents in one search; 0 for `DECISION_METHODS`."""
    extra: Columns = field(default_factory=dict)
    """Columns that were requested: of `within_budget`, `messages`, `step_formula` and `measure`."""

    @property
    def ratio(self) -> Fraction | None:
        """Cost of the single agent over that of the hierarchy."""
        return None if self.nested_exact is None else Fraction(self.single_agent, self.nested_exact)


def joint_actions(text: str, n: int, actions: int) -> list[int]:
    """Return the number of joint actions that each of n agents tries in a decision.

    The single agent replaces all agents by one.
    """
    if text == SINGLE_AGENT:
        return [actions**n]
    topology, tried = DECISION_METHODS.get(text, (text, None))
    if tried is not None:
        return tried(n, actions)
    return [actions ** (1 + below) for below in agents_below(topology, n)]


def within_budget(row: CostRow, needs: Sequence[int], budget: int) -> Columns:
    """Return the cost of a row if its team may try `budget` joint actions in a decision.

    The budget is divided over the agents as in a running team. `needs` are the joint actions that
    each agent tries without it. Operations are by Eq. 18, or by Eq. 23 for the single agent, with
    the joint actions tried.

    Raises
    ------
    ValueError
        If the budget is less than one joint action for each agent; one line.
    """
    if budget < len(needs):
        raise ValueError(
            f"budget = {budget}: {row.topology} needs one joint action for each of {row.agents} "
            f"agents, allowed: {len(needs)} or more"
        )
    tried = divide(budget, needs)
    operations = row.problem.sweep(tried)
    if row.nested_exact is None:  # the single agent has the rules of all agents together
        operations *= row.problem.rules ** (row.agents - 1)
    return {
        "budget": budget,
        "joint_actions": sum(needs),
        "joint_actions_tried": sum(tried),
        "operations": operations,
    }


def messages(text: str, n: int) -> Columns:
    """Return the number of messages of a decision.

    A single agent collects the states of all others and sends their actions. In a chain each agent
    receives the actions of all above. Variable elimination passes a table from agent to agent and
    the best actions back. In max-plus, neighbors exchange messages in each round. Broadcast are
    the states that agents send to all others in addition, for predictions.
    """
    sent = in_turn = 2 * n - 2
    broadcast = n * (n - 1)
    if text == SINGLE_AGENT:
        in_turn = 2 * (n > 1)
        broadcast = 0
    else:
        hierarchy = _hierarchy(DECISION_METHODS.get(text, (text,))[0], n)
        if not hierarchy.neighbors:
            sent = hierarchy.n_messages
            in_turn = hierarchy.depth - 1
        elif text == "max-plus":
            in_turn = MaxPlusSettings().rounds
            sent = in_turn * hierarchy.n_messages
    return {"messages": sent, "messages_in_turn": in_turn, "broadcast": broadcast}


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
    joint = sum(joint_actions(text, n, ACTIONS))
    if text == SINGLE_AGENT:
        return Counts(joint, joint * RULES**n, RULES**n)
    return Counts(joint, joint * RULES, n * RULES)


def measure(text: str, n: int) -> Columns:
    """Return the counts of a step of n agents by formula, counted and timed.

    A step that would take too long is not counted and timed.
    """
    formula = step_formula(text, n)
    columns: Columns = {"measured_rules": RULES, "measured_actions": ACTIONS}
    columns |= {f"{name}_formula_per_step": count for name, count in asdict(formula).items()}
    if text in MODEL_FREE or formula.rule_evaluations > MAX_OPERATIONS:
        return columns
    learner, scenario, hierarchy = _arrange(text, LineUpSettings(carts=n).build())
    team = Team(learner, scenario, hierarchy, policy_seed(0))
    _step(team, scenario)  # compiles everything
    before = astuple(team.counts)
    times = [_step(team, scenario)]
    while sum(map(sum, times)) < MIN_SECONDS and len(times) < MAX_STEPS:
        times.append(_step(team, scenario))
    # An episode has two steps, and only the second one updates weights.
    steps = 2 * len(times), 2 * len(times), len(times)
    counts = zip(asdict(formula), before, astuple(team.counts), steps, strict=True)
    counted = {f"{name}_per_step": int(after - b) // count for name, b, after, count in counts}
    deciding, learning = map(median, zip(*times, strict=True))
    return columns | counted | {"decision_ms": 1e3 * deciding, "learning_ms": 1e3 * learning}


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


def _step(team: Team, scenario: Scenario) -> tuple[float, float]:
    """Return the times (decision, learning) of the second step of an episode [s].

    In the first step the learner has no previous state.
    """
    _, record = control_loop(scenario, team, episodes=1, steps=2, seed=0)
    return record.deciding, record.learning
