"""The cost of a topology, three times: by formula, counted in the running system, timed.

The formulas (Eq. 18-23) count operations of a sweep over all states; the running system visits one
state a step. What they share is the number of joint actions that every agent tries,
``|A| ** (1 + |below|)``, and the number of rules that value each: these are counted, and compared.

In a coordination graph agents try joint actions of themselves and their neighbours, and decide by
variable elimination, whose own operations are timed, but not counted.

Some ways to decide stand in place of a topology, see `WAYS`: they try few of all joint actions.

Counting and timing use the line-up scenario, whose prediction costs next to nothing, and sigmoid
membership functions, with which every rule does fire.

Tables are for the terminal, as JSON, CSV and LaTeX. Integers keep every digit in the files. A ratio
beyond 2 ** 53, where floating-point numbers lie farther apart, is rounded to an integer.
"""

import json
import re
import sys
import tracemalloc
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, astuple, dataclass
from fractions import Fraction
from functools import cache
from html import escape
from itertools import chain, product
from statistics import median
from typing import Any, Literal

from ...core.agents.cost import Problem, below_counts, is_chain
from ...core.agents.loop import control_loop, join_agents, policy_seed
from ...core.agents.team import Team
from ...core.evaluators.best_response import CUTS
from ...core.evaluators.coordination import MaxPlusSettings
from ...core.evaluators.evaluator import Counts
from ...core.interface.hierarchy import Hierarchy
from ...core.interface.scenario import Scenario
from ...core.learners.learner import Decision
from ...core.learners.td import TDLambdaSettings
from ...core.numerics import pd
from ...core.rules.rule_base import RuleBaseSettings
from ...scenarios.line_up import LineUp, LineUpSettings
from ...topologies import build, parse
from ...topologies.view import aligned, readable
from ..presentation.tables import in_csv, in_latex
from ..results.statistics import NOT_NEGATIVE, Estimate, bootstrap

SINGLE_AGENT = "single-agent"
"""Stands in place of a topology for the one agent of Eq. 23."""
MEMBERSHIPS = 5
PAPER = Problem(5**7, 4, 450)
"""|S|, |A| and L of the paper's experiment."""
RULES = MEMBERSHIPS**2
"""|S| of an agent in what is counted and timed."""
LEARNER = TDLambdaSettings(
    rule_base=RuleBaseSettings(membership="sigmoid", memberships=MEMBERSHIPS, order=2),
    decision=Decision(rule="value", evaluator="exact"),
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
LEAST_SECONDS, MOST_TIMES = 0.3, 100
"""How long each repeat is timed at least, but no more times than that."""
LABELLED = re.compile(r"([\w -]+)=(.+)")
"""A topology with a label of one's own."""


@dataclass(frozen=True)
class StepCost:
    """What one step of the running system costs."""

    counted: Counts
    """What was counted, for the whole team."""
    deciding: float
    """Median time of a decision [s]."""
    learning: float
    """Median time of learning from a step [s]."""
    memory: int
    """Greatest memory held by team and step [bytes]."""
    repeats: tuple[float, ...]
    """The time of a step in each repeat, each with a new team [s]."""

    @property
    def step(self) -> Estimate:
        """The mean time of a step over repeats with its 95 % interval [s]; of one, no interval."""
        return bootstrap(self.repeats, bounds=NOT_NEGATIVE)


@dataclass(frozen=True)
class CostRow:
    """The cost of one topology over n agents; Eq. 19 and 21 are of chains only."""

    agents: int
    topology: str
    """Its label, or how it is written in a spec."""
    nested_exact: int | None
    nested_closed_form: int | None
    nested_asymptotic: Fraction | None
    single_agent: int
    formula: Counts | None = None
    """What a step of the whole team comes to by the formulas, if it was to be measured."""
    measured: StepCost | None = None
    network: tuple[int, int] | None = None
    """If asked for, messages of a decision, and how many of them follow one another."""

    @property
    def ratio(self) -> Fraction | None:
        """How many times costlier the single agent is."""
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
    if not hierarchy.neighbours:
        return hierarchy.messages, hierarchy.depth - 1
    rounds = MaxPlusSettings().rounds
    return (rounds * hierarchy.messages, rounds) if text == "max-plus" else (2 * n - 2, 2 * n - 2)


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
        return Counts(PAPER.actions**n, (PAPER.actions * RULES) ** n, RULES**n)
    joint = sum(joint_actions(text, n, PAPER.actions))
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
    assert team.evaluator is not None
    before = astuple(team.evaluator.counts)
    times = [_timed(team, scenario)]
    # An episode here has two steps, of which the second alone changes weights.
    steps = 2 * len(times[0]), 2 * len(times[0]), len(times[0])
    after = astuple(team.evaluator.counts)
    counted = (int(b - a) // n for a, b, n in zip(before, after, steps, strict=True))
    for seed in range(1, repeats):
        team = Team(learner, scenario, hierarchy, policy_seed(seed))
        _step(team, scenario)
        times.append(_timed(team, scenario))
    deciding, learning = (median(part) for part in zip(*chain(*times), strict=True))
    each = tuple(sum(map(median, zip(*taken, strict=True))) for taken in times)
    return StepCost(Counts(*counted), deciding, learning, memory, each)


def _timed(team: Team, scenario: Scenario) -> list[tuple[float, float]]:
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
    usual = "variable-elimination" if settings.kind == "coordination-graph" else "exact"
    decision = Decision(rule="value", evaluator=text if text in WAYS else usual)
    learner = LEARNER.model_copy(update={"decision": decision})
    return learner, line_up, build(settings, line_up.agents, pairs(n))


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


Form = Literal["table", "json", "csv", "latex"]

FORMULAS = (
    ("nested_exact", "Eq. 18"),
    ("nested_closed_form", "Eq. 19"),
    ("nested_asymptotic", "Eq. 21"),
    ("single_agent", "single agent"),
    ("ratio", "ratio"),
)
"""Columns by name, with their heading."""
MEASURED = ("formula", "counted", "rules valued", "updates", "ms", "MB")
"""Headings of what was measured per step."""
NETWORK = ("messages", "in turn", "1 ms", "10 ms", "1 ms*", "10 ms*")
"""Headings of messages, and of the seconds that a decision waits for them."""
OF_THE_PAPER = PAPER.chain_closed_form(4)
"""Operations of four agents by Eq. 19, with the paper's |S|, |A| and L."""


def written(rows: Sequence[CostRow], form: Form) -> str:
    """Return the rows in a format."""
    if form == "table":
        return _table(rows)
    if form == "latex":
        return "\n\n".join(map(_tabular, _cells(rows).values()))
    records = [_record(row) for row in rows]
    most = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)  # those of n = 1000 are more than Python prints
    try:
        if form == "json":
            return "[" + ",\n ".join(json.dumps(record) for record in records) + "]"
        return in_csv(pd.DataFrame(records, dtype=object)).rstrip("\n")
    finally:
        sys.set_int_max_str_digits(most)


def scientific(value: int | Fraction | None) -> str:
    """Return a number for reading: some digits, powers of ten if it is large.

    Examples
    --------
    >>> scientific(2457562500000), scientific(Fraction(5, 2)), scientific(None)
    ('2.458e12', '2.5', '-')
    """
    if value is None:
        return "-"
    if isinstance(value, Fraction) and value.denominator > 1 and value < 1000:
        return f"{float(value):.4g}"
    return readable(round(value), 10**7)


def _record(row: CostRow) -> dict[str, Any]:
    """Return a row with integers as integers; Eq. 21 is rounded to the nearest one."""
    asymptotic = row.nested_asymptotic
    record = {name: getattr(row, name) for name in ("agents", "topology", *dict(FORMULAS))}
    record["nested_asymptotic"] = None if asymptotic is None else round(asymptotic)
    if row.ratio is not None:
        record["ratio"] = float(row.ratio) if row.ratio < 2**53 else round(row.ratio)
    if row.network is not None:
        record["messages"], record["messages_in_turn"] = row.network
    for what, counts in (("_formula", row.formula), ("", row.measured and row.measured.counted)):
        if counts is not None:
            record |= {f"{name}{what}_per_step": n for name, n in asdict(counts).items()}
    if (cost := row.measured) is not None:
        record |= {"deciding_s": cost.deciding, "learning_s": cost.learning}
        record |= {"memory_bytes": cost.memory, "repeats": len(cost.repeats)}
        record["step_s"], low, high = map(float, cost.step)
        if len(cost.repeats) > 1:
            record |= {"step_s_low": low, "step_s_high": high}
    return record


def _cells(rows: Sequence[CostRow]) -> dict[str, list[list[str]]]:
    """Return the cells of each table, headings first: formulas, then what of rows was asked for."""
    return {
        kind: [["n", "topology", *titles], *([str(r.agents), r.topology, *cells(r)] for r in rows)]
        for kind, titles, cells in (
            ("topology", dict(FORMULAS).values(), _formula_cells),
            ("formula", MEASURED, _measured_cells),
            ("network", NETWORK, _network_cells),
        )
        if kind == "topology" or any(getattr(row, kind) is not None for row in rows)
    }


def _formula_cells(row: CostRow) -> list[str]:
    return [scientific(getattr(row, name)) for name, _ in FORMULAS]


def _network_cells(row: CostRow) -> list[str]:
    assert row.network is not None
    waits = (_amount(1e-3 * ms * count) for count in reversed(row.network) for ms in (1, 10))
    return [*(f"{count:,}" for count in row.network), *waits]


def _table(rows: Sequence[CostRow]) -> str:
    tables = _cells(rows)
    lines = [*aligned(tables["topology"], "><>>>>>"), ""]
    lines.append("Operations: nested by Eq. 18, chains by Eq. 19 and 21; single agent by Eq. 23.")
    if any(row.agents == 4 and row.nested_closed_form == OF_THE_PAPER for row in rows):
        lines.append("The paper prints 2.45e12 (nested) and 1.1e27 (single agent) for n = 4.")
    if "formula" in tables:
        same = [row.formula == row.measured.counted for row in rows if row.measured is not None]
        lines += ["", f"Per step of the running system (line-up scenario, |A| = 4, |S| = {RULES}):"]
        lines += ["", *aligned(tables["formula"], "><>>>>>>"), ""]
        lines += ["formula, counted: joint actions tried; ms: deciding and learning;"]
        most = max((len(row.measured.repeats) for row in rows if row.measured), default=1)
        if most > 1:
            lines += [f"±: a 95 % interval of the mean of {most} repeats, each with a new team;"]
        lines += ["-: not measured, beyond a second or so a step."]
        lines += [f"All counts equal the formulas in {sum(same)} of {len(same)} rows."] * bool(same)
    if "network" in tables:
        lines += ["", "Messages of a decision, and how long it waits for them [s]:", ""]
        lines += [*aligned(tables["network"], "><>>>>>>"), ""]
        lines += ["in turn: how many follow one another, others going at once, of 1 or 10 ms each;"]
        lines += ["*: on a channel that carries one message at a time."]
    return "\n".join(lines)


def _measured_cells(row: CostRow) -> list[str]:
    joint = None if row.formula is None else row.formula.joint_actions
    if row.measured is None:
        return [scientific(joint), *["-"] * len(MEASURED[1:])]
    step, ms = row.measured.step, _amount(1e3 * float(row.measured.step.value))
    if len(row.measured.repeats) > 1:
        ms += f"±{_amount(1e3 * float(step.high - step.value), 2)}"
    counts = joint, *astuple(row.measured.counted)
    return [*map(scientific, counts), ms, _amount(1e-6 * row.measured.memory)]


def _amount(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if value < 1000 else f"{value:,.0f}"


def _tabular(cells: Sequence[Sequence[str]]) -> str:
    head, *lines = cells
    rows = [(n, topology, *map(_latex_cell, numbers)) for n, topology, *numbers in lines]
    frame = pd.DataFrame(rows, columns=head)
    return in_latex(frame, "topology", f"rl{'r' * (len(head) - 2)}").rstrip()


def _latex_cell(text: str) -> str:
    """Return a cell for LaTeX, numbers as they are printed."""
    if text == "-":
        return "--"
    mantissa, e, power = text.partition("e")
    if e:
        return rf"${mantissa}\times 10^{{{int(power)}}}$"
    return mantissa.replace(",", r"\,").replace("±", r"$\pm$")


MOST_REPEATS = 1000
"""A repeat takes a third of a second or more."""


@dataclass(frozen=True)
class CostTable:
    """Costs, a row for every topology and number of agents; printed or shown by a notebook."""

    rows: tuple[CostRow, ...]
    """The costs as exact integers."""

    @property
    def csv(self) -> str:
        """The table as CSV, with every digit."""
        return written(self.rows, "csv")

    @property
    def latex(self) -> str:
        """The table for LaTeX, with the package booktabs."""
        return written(self.rows, "latex")

    def __str__(self) -> str:
        return written(self.rows, "table")

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def cost_table(
    topologies: Sequence[str] = ("chain",),
    agents: Iterable[int] = (4,),
    problem: Problem = PAPER,
    *,
    measured: bool = False,
    repeats: int = 1,
    network: bool = False,
) -> CostTable:
    """Return what hierarchies cost, by Eq. 18-23 and, if asked, measured.

    Parameters
    ----------
    topologies
        As in a spec, or ``label=topology`` with a label of one's own; ``single-agent``, or ways to
        decide: ``best-response``, ``max-plus``, ``fitted-q``, ``hierarchy-ppo``.
    agents
        Numbers of agents.
    problem
        Rules and actions of an agent, and steps of an episode; those of the paper unless given.
    measured
        Whether to count and time steps of the running system, too.
    repeats
        How often steps are timed, each with a new team; from two on the time has an interval.
    network
        Whether to count the messages of a decision, and how many of them follow one another.

    Raises
    ------
    ValueError
        If there is no topology, one or a number is refused, or two have one label; one line.
    """
    if not 1 <= repeats <= MOST_REPEATS:
        raise ValueError(f"repeats = {repeats}, allowed: 1 to {MOST_REPEATS}")
    if not topologies:
        raise ValueError("topology = none, allowed: one or more, such as chain or tree:2")
    matches = [LABELLED.fullmatch(text) for text in topologies]
    named = [m.groups() if m else (t, t) for m, t in zip(matches, topologies, strict=True)]
    labels = [label for label, _ in named]
    rows = []
    for (label, text), n in product(named, agents):
        if labels.count(label) > 1:
            raise ValueError(f"topology = {label!r} more than once; name each: LABEL={text}")
        is_one = text not in {SINGLE_AGENT, *WAYS} and is_chain(agents_below(text, n))
        tried = None if text == SINGLE_AGENT else joint_actions(text, n, problem.actions)
        row = CostRow(
            agents=n,
            topology=label,
            nested_exact=None if tried is None else problem.sweep(tried),
            nested_closed_form=problem.chain_closed_form(n) if is_one else None,
            nested_asymptotic=problem.chain_asymptotic(n) if is_one else None,
            single_agent=problem.single_agent(n),
            formula=step_formula(text, n) if measured else None,
            measured=measure(text, n, repeats) if measured else None,
            network=messages(text, n) if network else None,
        )
        rows.append(row)
    return CostTable(tuple(rows))
