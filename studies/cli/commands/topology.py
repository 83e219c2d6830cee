"""``nested-agents topology``: which hierarchies there are, and what one of them looks like."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ....core.agents.loop import Agents
from ....core.interface.scenario import groups_of
from ....topologies.view import Form, HierarchyView, kinds, printed, view
from ...errors import SpecError, refused
from .. import options

if TYPE_CHECKING:
    from ...spec.spec import Spec

TOPOLOGY = {"kind", "members", "edges"}
"""Keys of a file that holds a topology and no more."""


@click.group(no_args_is_help=False)
def topology() -> None:
    """List the topologies, or show one of them."""


@topology.command("list")
def list_all() -> int:
    """List the topologies, built-in and installed."""
    print(kinds())
    return 0


@topology.command()
@click.argument("topology", metavar="SPEC")
@click.option(
    "--agents",
    type=click.IntRange(1),
    metavar="N",
    help="Number of agents; default: two for each robot, else those that the topology names, "
    "else 4.",
)
@click.option(
    "--robots",
    type=click.IntRange(1),
    metavar="N",
    help="Number of robots, whose agents are consecutive; default: one for every two agents.",
)
@click.option(
    "--per",
    type=click.Choice(["actuator", "body", "team"]),
    default="actuator",
    help="What there is one agent for, as the key agents of a spec says.",
)
@click.option(
    "--actions", type=click.IntRange(2), metavar="N", default=4, help="Actions of each actuator."
)
@options.formats("table", "json")
@options.plot
def show(
    topology: str, form: Form, plot: Path | None, per: Agents, actions: int, **sizes: int | None
) -> int:
    """Show a topology: edges, order of decision, who sees whom, cost.

    SPEC is a topology as in a spec: chain:reversed, tree:2, file.py:function, graph.json,
    teams.json, ...; or the spec of a study, whose hierarchies are shown over its own agents.
    """
    from ....topologies.drawing import draw

    with refused():
        views = _of_spec(topology)
        if views is None:
            views = [view(topology, actions=actions, per=per, **sizes)]
        elif any(sizes.values()) or per != "actuator":
            raise SpecError(f"{topology}: is the spec of a study, which says its own agents")
        for number, shown in enumerate(views, 1):
            if plot is not None:
                several = f"-{number}" if len(views) > 1 else ""
                path = plot.with_name(f"{plot.stem}{several}{plot.suffix}")
                bodies, failing = shown.bodies, shown.failing
                draw(shown.hierarchy, path, bodies=bodies, title=shown.title, failing=failing)
            print(printed(shown, form), end="\n\n" if number < len(views) else "\n")
    return 0


def _of_spec(path: str) -> list[HierarchyView] | None:
    """Return the hierarchies of a study's spec; None if the path is not that of one."""
    if not path.endswith(".toml") or not Path(path).is_file():
        return None
    try:
        table = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except ValueError:
        return None  # whoever reads it as a topology says why
    if TOPOLOGY & table.keys() or (list(table) == ["topology"] and "kind" not in table["topology"]):
        return None
    from ...spec.spec import Spec

    return _views(Spec.load(Path(path)))


def _views(spec: Spec) -> list[HierarchyView]:
    """Return the distinct hierarchies of conditions and evaluations, called by the first of each.

    Raises
    ------
    SpecError
        If one cannot be built; one line.
    """
    distinct: dict[tuple[object, ...], HierarchyView] = {}
    with spec.sources.active():
        for condition in spec.conditions():
            others = {f"{condition.label}, {name}": s for name, s in condition.evaluations}
            for label, settings in ({condition.label: condition.settings} | others).items():
                with refused(after=f" (condition {label!r})"):
                    scenario, hierarchy = settings.arrange(settings.scenario.build())
                own, failures = len(scenario.action_set), settings.topology.failures
                shown = HierarchyView(label, hierarchy, groups_of(scenario), own, failures)
                parts = hierarchy.told, hierarchy.considers, failures, own
                distinct.setdefault((hierarchy.agents, hierarchy.edges, *parts), shown)
    return list(distinct.values())
