"""Hierarchies as tables and as JSON, for the command line."""

import json
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import accumulate, zip_longest
from textwrap import wrap
from typing import Literal

from ..core.agents.cost import below_counts
from ..core.agents.joint import Granularity, joint_blocks
from ..core.hierarchy.failures import MessageFailure
from ..core.hierarchy.hierarchy import Hierarchy
from . import TOPOLOGIES, TopologySettings, build, parse
from .builders import names_of
from .config import read
from .names import check_legible
from .strings import ARGUMENTS

Form = Literal["table", "json"]

MOST_AGENTS = 1000
"""Maximum number of agents in a table."""


@dataclass(frozen=True)
class HierarchyView:
    """The hierarchy that a topology makes of given agents."""

    text: str
    """The topology as the user wrote it."""
    hierarchy: Hierarchy
    """The hierarchy."""
    bodies: tuple[tuple[int, ...], ...]
    """Agent indices by body."""
    actions: int
    """Number of actions of an agent."""
    failures: tuple[MessageFailure, ...] = ()
    """Failures of messages."""
    others: tuple[str, ...] = ()
    """Further topologies that give the same hierarchy."""

    @property
    def tries(self) -> tuple[int, ...]:
        """Joint actions per step that each agent tries in an exhaustive search, in agent order."""
        return tuple(self.actions ** (1 + count) for count in below_counts(self.hierarchy))

    @property
    def failing(self) -> tuple[int, ...]:
        """Agents with messages that fail at some time."""
        masks = [f.mask(self.hierarchy.agents, "topology.failures") for f in self.failures]
        return tuple(i for i in range(len(self.hierarchy)) if any(mask[i] for mask in masks))

    @property
    def remarks(self) -> list[str]:
        """Lines on equal topologies, failures, and relations other than the defaults."""
        both = self.hierarchy.communication, self.hierarchy.lookahead
        communication, lookahead = (r if isinstance(r, str) else " and ".join(r) for r in both)
        messages = f"{self.hierarchy.n_messages:,} messages a step"
        relations = f"communication: {communication}; lookahead: {lookahead}; {messages}"
        is_changed = both != ("ancestors", "descendants")
        lines = [f"the same hierarchy: {', '.join(self.others)}"] * bool(self.others)
        lines += [relations] * is_changed
        return lines + [f"fails: {failure.text}" for failure in self.failures]

    @property
    def title(self) -> str:
        """Title in one line."""
        n = len(self.hierarchy)
        depth = self.hierarchy.depth
        agents = f"{n} agent{'s' if n > 1 else ''}"
        count = format_count(sum(self.tries))
        return f"{self.text}: {agents}, depth {depth}, {count} joint actions a step (exhaustive)"


def view(
    text: str, agents: int | None, robots: int | None, actions: int, per: Granularity = "actuator"
) -> HierarchyView:
    """Build the topology that `text` describes, for a number of agents or robots.

    `per` is the granularity: one agent per actuator, per body, or for the team.

    Raises
    ------
    ValueError
        If the topology or the numbers are refused.
    """
    settings = parse(text)
    named = names_in(settings) if per == "actuator" else ()
    names, bodies = team_of(agents, robots, named)
    names, blocks = joint_blocks(names, bodies, actions, per)
    if per != "actuator":
        bodies = tuple((i,) for i in range(len(names)))
    hierarchy = build(settings, names, bodies)
    return HierarchyView(text, hierarchy, bodies, actions ** len(blocks[0]))


def names_in(settings: TopologySettings) -> tuple[str, ...]:
    """Return the agents that the settings name, in order; empty for most kinds."""
    if settings.kind == "file":
        content = read(settings.title)
        if isinstance(content, TopologySettings):
            return names_in(content)
        names = [str(node) for node in content]
    else:  # lists are lists of names, except in the settings that all topologies have
        shared = set(TopologySettings.model_fields)
        table = settings.model_dump(exclude=shared) if settings.kind in TOPOLOGIES.built_in else {}
        names = names_of(value for value in table.values() if isinstance(value, tuple))
    check_legible(names)
    return tuple(dict.fromkeys(names))


def team_of(
    agents: int | None = None, robots: int | None = None, named: Sequence[str] = ()
) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]:
    """Return the names of a number of agents or robots, and agent indices by body.

    A robot has two wheels unless the numbers say otherwise. Its agents are called ``robot1.left``
    and ``robot1.right``, with more wheels ``robot1.wheel1`` and so on, and ``agent1`` if it has
    one. Names in `named`, which the topology uses, take precedence.

    Raises
    ------
    ValueError
        If the numbers do not fit each other or the names.

    Examples
    --------
    >>> team_of(4)
    (('robot1.left', 'robot1.right', 'robot2.left', 'robot2.right'), ((0, 1), (2, 3)))
    """
    n = agents or 2 * (robots or 0) or len(named) or 4
    if n > MOST_AGENTS:
        raise ValueError(f"agents = {n}, allowed: up to {MOST_AGENTS:,} in a table or picture")
    robots = robots or (n if n % 2 else n // 2)
    if n % robots:
        raise ValueError(f"agents = {n} cannot be divided among robots = {robots}")
    wheels = n // robots
    wheel_names = ["left", "right"] if wheels == 2 else [f"wheel{w + 1}" for w in range(wheels)]
    names = tuple(f"robot{r + 1}.{name}" for r in range(robots) for name in wheel_names)
    if wheels == 1:
        names = tuple(f"agent{i + 1}" for i in range(n))
    if named and not set(named) <= set(names):
        if len(named) != n:
            raise ValueError(f"the topology names {len(named)} agents, {n} are asked for")
        names = tuple(named)
    return names, tuple(tuple(range(r * wheels, (r + 1) * wheels)) for r in range(robots))


def list_kinds() -> str:
    """Return all topologies, built-in and installed, for printing."""
    lines = []
    for kind in TOPOLOGIES.built_in:
        model = TOPOLOGIES.model(kind)
        argument = f":{ARGUMENTS[kind][0]}" if kind in ARGUMENTS else ""
        if argument and not any(field.is_required() for field in model.model_fields.values()):
            argument = f"[{argument}]"
        lines += [f"{kind}{argument}", f"    {(model.__doc__ or '').splitlines()[0]}"]
    for name, value in TOPOLOGIES.installed().items():
        lines += [name, f"    Installed: {value}"]
    return "\n".join(lines)


def format_view(view: HierarchyView, form: Form) -> str:
    """Return a view for printing."""
    hierarchy = view.hierarchy
    names = hierarchy.agents
    n = len(hierarchy)
    below = [[names[j] for j in hierarchy.searched(i)] for i in range(n)]
    if form == "json":
        content = {
            "topology": view.text,
            "agents": names,
            "edges": [(names[a], names[b]) for a, b in hierarchy.edges],
            "neighbors": [(names[a], names[b]) for a, b in hierarchy.neighbors],
            "order": [names[i] for i in hierarchy.order],
            "lookahead": dict(zip(names, below, strict=True)),
            "remarks": view.remarks,
            "depth": hierarchy.depth,
            "joint_actions_per_step": sum(view.tries),
        }
        lines = (f"{json.dumps(key)}: {json.dumps(value)}" for key, value in content.items())
        return "{" + ",\n ".join(lines) + "}"
    neighbors = hierarchy.neighbors
    pairs = sorted([*hierarchy.edges, *neighbors, *((b, a) for a, b in neighbors)])
    under = {i: [names[b] for a, b in pairs if a == i] for i in range(n)}
    rows = [("", "agent", "lookahead", "tries", "neighbors" if neighbors else "subordinates")]
    for rank, i in enumerate(hierarchy.order):
        subordinates = ", ".join(under[i]) or "-"
        tried = format_count(view.tries[i])
        rows.append((str(rank + 1), names[i], str(len(below[i])), tried, subordinates))
    legend = [
        "In decision order. lookahead: agents over whose actions the agent searches;",
        "tries: joint actions a step in an exhaustive search (large teams try fewer).",
    ]
    return "\n".join([view.title, *view.remarks, "", *align(rows, "><>><"), "", *legend])


def align(rows: Sequence[Sequence[str]], sides: str, heads: int = 0) -> list[str]:
    """Return rows as lines with aligned columns, at most as wide as the terminal.

    Parameters
    ----------
    rows
        Cells.
    sides
        Alignment of each column, ``<`` or ``>``.
    heads
        Number of first columns that are repeated where further columns do not fit and continue in a
        table below; long texts in the last of them are wrapped. By default, long lines are cut.
    """
    most = shutil.get_terminal_size().columns if sys.stdout.isatty() else sys.maxsize
    if heads:
        rows = [line for row in rows for line in _broken(row, heads - 1, most // 2)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    ends = [end - 2 for end in accumulate(width + 2 for width in widths)]
    if heads and ends[-1] > most:
        n = max(heads + 1, sum(end <= most for end in ends))
        first = [r[:n] for r in rows]
        rest = [[*r[:heads], *r[n:]] for r in rows]
        below = ["", *align(rest, sides[:heads] + sides[n:], heads)] * (n < len(widths))
        return [*align(first, sides[:n]), *below]
    lines = []
    for row in rows:
        cells = (f"{c:{s}{w}}" for c, s, w in zip(row, sides, widths, strict=True))
        line = "  ".join(cells).rstrip()
        lines.append(line if len(line) <= most else line[: most - 4] + " ...")
    return lines


def _broken(row: Sequence[str], column: int, most: int) -> Iterator[tuple[str, ...]]:
    """Yield the rows into which the long text of a column of a row is wrapped."""
    text = row[column]
    parts = wrap(text, most or 1) if len(text) > most else [text]
    cells = [parts if i == column else [cell] for i, cell in enumerate(row)]
    yield from zip_longest(*cells, fillvalue="")


def format_count(number: int, few: int = 10**9) -> str:
    """Return an integer with all digits if it is below `few`, else in scientific notation.

    Examples
    --------
    >>> format_count(1364), format_count(4**40)
    ('1,364', '1.209e24')
    """
    if number < few:
        return f"{number:,}"
    return f"{Decimal(number):.3e}".replace("e+", "e")
