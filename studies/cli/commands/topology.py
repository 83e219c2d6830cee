"""``nested-agents topology``: which hierarchies there are, and what one of them looks like."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .. import options

if TYPE_CHECKING:
    from ....core.agents.joint_agents import Agents
    from ....topologies.view import Form


@click.command()
@click.argument("action", type=click.Choice(["list", "show"]), metavar="list|show")
@click.argument("topology", metavar="[SPEC]", required=False)
@click.option(
    "--agents",
    type=int,
    metavar="N",
    help="Number of agents; default: those that the topology names, else robots times wheels, "
    "else 4.",
)
@click.option(
    "--robots",
    type=int,
    metavar="N",
    help="Number of robots, whose agents are consecutive.",
)
@click.option(
    "--wheels",
    type=int,
    metavar="N",
    help="Wheels (agents) of a robot; default: 2 if the number of agents is even, else 1.",
)
@click.option(
    "--per",
    type=click.Choice(["actuator", "body", "team"]),
    default="actuator",
    help="What there is one agent for, as the key agents of a spec says.",
)
@click.option("--actions", type=int, metavar="N", default=4, help="Actions of each actuator.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json"]),
    default="table",
    help="How to print it.",
)
@options.plot
def command(
    action: str,
    topology: str | None,
    agents: int | None,
    robots: int | None,
    wheels: int | None,
    per: Agents,
    actions: int,
    form: Form,
    plot: Path | None,
) -> int:
    """List the topologies, or show one of them: edges, order of decision, who sees whom, cost.

    SPEC is a topology as in a spec: chain:reversed, tree:2, file.py:function, graph.json,
    teams.json, ...; or the spec of a study, whose hierarchies are shown over its own agents.
    """
    from ....topologies.view import kinds, printed, view
    from ...spec.errors import SpecError
    from ..hierarchies import of_spec

    try:
        if action == "list":
            if topology is not None:
                raise SpecError(f"topology list {topology}: takes no SPEC; see topology show")
            for option, given in (
                ("--agents", agents), ("--robots", robots), ("--wheels", wheels), ("--plot", plot)
            ):  # fmt: skip
                if given is not None:
                    raise SpecError(f"topology list {option} {given}: is for topology show")
            print(kinds(form))
        elif topology is None:
            raise SpecError("topology show: SPEC is missing; see nested-agents topology list")
        else:
            found = of_spec(topology)
            if found is None:
                found = [view(topology, agents, robots, wheels, actions, per)]
            elif agents or robots or wheels or per != "actuator":
                raise SpecError(f"{topology}: is the spec of a study, which says its own agents")
            for number, shown in enumerate(found, 1):
                if plot is not None:
                    several = f"-{number}" if len(found) > 1 else ""
                    shown.draw(plot.with_name(f"{plot.stem}{several}{plot.suffix}"))
                print(printed(shown, form), end="\n\n" if number < len(found) else "\n")
    except ValueError as error:
        raise SpecError(str(error)) from None
    return 0
