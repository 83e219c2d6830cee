"""``nested-agents topology``: which hierarchies there are, and what one of them looks like."""

from __future__ import annotations

from typing import Annotated, Literal

import tyro

from .options import Figure, Number


def command(
    action: Annotated[Literal["list", "show"], tyro.conf.Positional],
    topology: Annotated[
        str | None,
        tyro.conf.Positional,
        tyro.conf.arg(metavar="[SPEC]", help_behavior_hint=""),
    ] = None,
    agents: Number = None,
    robots: Number = None,
    wheels: Number = None,
    actions: int = 4,
    format: Literal["table", "json"] = "table",
    plot: Figure = None,
) -> int:
    """List the topologies, or show one of them: edges, order of decision, who sees whom, cost.

    Parameters
    ----------
    action
        What to do.
    topology
        A topology as in a spec: chain:reversed, tree:2, file.py:function, graph.json, ...
    agents
        Number of agents; default: those that the topology names, else robots times wheels, else 4.
    robots
        Number of robots, whose agents are consecutive.
    wheels
        Wheels (agents) of a robot; default: 2 if the number of agents is even, else 1.
    actions
        Actions of each agent.
    format
        How to print it.
    plot
        A picture to write: SVG, PNG or PDF by suffix.
    """
    from ....topologies.view import kinds, printed, view
    from ...spec.errors import SpecError

    try:
        if action == "list":
            if topology is not None:
                raise SpecError(f"topology list {topology}: takes no SPEC; see topology show")
            for option, given in (
                ("--agents", agents), ("--robots", robots), ("--wheels", wheels), ("--plot", plot)
            ):  # fmt: skip
                if given is not None:
                    raise SpecError(f"topology list {option} {given}: is for topology show")
            print(kinds(format))
        elif topology is None:
            raise SpecError("topology show: SPEC is missing; see nested-agents topology list")
        else:
            shown = view(topology, agents, robots, wheels, actions)
            if plot is not None:
                shown.draw(plot)
            print(printed(shown, format))
    except ValueError as error:
        raise SpecError(str(error)) from None
    return 0
