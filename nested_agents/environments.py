"""Our worlds in the registries of Gymnasium and PettingZoo.

Importing this module registers them::

    gymnasium.make("nested_agents.environments:NestedAgents/Arm-v0", joints=4)
    gymnasium.make_vec("nested_agents.environments:NestedAgents/BoxPushing-v0", 8, robots=4)

    import nested_agents.environments
    weak = [{"kind": "weak", "wheels": "*", "gain": 0.5}]
    pettingzoo.make("parallel", "NestedAgents/BoxPushing-v0", failures=weak)
    pettingzoo.make("aec", "NestedAgents/Arm-v0", topology={"kind": "tree", "failures": [...]})

Keywords are those of the ``[scenario]`` table of a spec, what fails of wheels and joints included.
An AEC environment also takes a ``topology``, which gives the order of decisions and the failures of
the messages with decided actions.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import gymnasium
import pettingzoo

if TYPE_CHECKING:
    from .scenarios.adapters.turns import TurnBasedEnv
    from .scenarios.environments import AgentsEnv, JointEnv, Players

WORLDS = {
    "BoxPushing": ("box-pushing", 450),
    "Arm": ("kinematic-chain", 60),
    "LineUp": ("line-up", 40),
    "MatrixGame": ("matrix-game", 1),
    "TeamGame": ("team-game", 1),
}
"""The kind of scenario of an id, and the most steps of its episodes."""


def env_id(name: str) -> str:
    """Return the id of one of `WORLDS`.

    >>> env_id("Arm")
    'NestedAgents/Arm-v0'
    """
    return f"NestedAgents/{name}-v0"


def register() -> None:
    """Register all ids with both libraries; again, nothing happens."""
    for name, (kind, steps) in WORLDS.items():
        options = {"kind": kind, "steps": steps}
        known = env_id(name)
        if known not in gymnasium.registry:
            gymnasium.register(known, f"{__name__}:joint", kwargs=options)
        if known not in pettingzoo.parallel_registry:
            pettingzoo.register("parallel", known, f"{__name__}:parallel", kwargs=options)
        if known not in pettingzoo.aec_registry:
            pettingzoo.register("aec", known, f"{__name__}:turns", kwargs=options)


def joint(kind: str, steps: int | None = None, **options: Any) -> JointEnv:
    """Return a Gymnasium environment in which one player acts for all agents.

    Parameters
    ----------
    kind
        Kind of the scenario.
    steps
        Maximum number of steps of an episode. By default that of the registered id.
    **options
        Keys of the ``[scenario]`` table; ``render_mode``; and ``by_agent = true`` for observations
        with a row for each agent.

    Raises
    ------
    ValueError
        If there is no such key, or a value is out of range; one line.
    """
    from .scenarios.environments import JointEnv

    return JointEnv(**_arguments(kind, steps, options))


def parallel(
    kind: str, steps: int | None = None, players: Players = "agents", **options: Any
) -> AgentsEnv:
    """Return a PettingZoo parallel environment with a player for every agent; see `joint`.

    With ``players = "bodies"`` there is one for every body: for every robot, not every wheel.
    """
    from .scenarios.environments import AgentsEnv

    if players not in ("agents", "bodies"):
        raise ValueError(f"players = {players!r}, allowed: agents, bodies")
    return AgentsEnv(players=players, **_arguments(kind, steps, options))


def _arguments(kind: str, steps: int | None, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of an environment; further options are a ``[scenario]`` table."""
    from .core.interface.scenario import checked_scenario
    from .core.plugins.models import tuples
    from .scenarios import SCENARIOS

    own = {key: options[key] for key in ("by_agent", "render_mode") if key in options}
    table = tuples({key: value for key, value in options.items() if key not in own})
    scenario = checked_scenario(SCENARIOS.parsed(kind, **table).build())
    steps = dict(WORLDS.values()).get(kind) if steps is None else steps
    if steps is None:
        raise ValueError(f"steps is missing: kind = {kind!r} has no default, give a number")
    return {"scenario": scenario, "steps": steps, **own}


def turns(
    kind: str,
    steps: int | None = None,
    topology: str | Mapping[str, Any] = "chain",
    **options: Any,
) -> TurnBasedEnv:
    """Return a PettingZoo AEC environment in which agents act in the order of a hierarchy.

    Parameters
    ----------
    kind, steps, **options
        As those of `joint`.
    topology
        Order of decisions and failures of messages, as in a spec.

    Raises
    ------
    ValueError
        If there is no such key or topology, or a value is out of range; one line.
    """
    from .core.interface.abilities import interactions_of
    from .scenarios.adapters.turns import TurnBasedEnv
    from .topologies import build, parse

    env = parallel(kind, steps, **options)
    settings = parse(topology)
    world = env.scenario
    hierarchy = build(settings, world.agents, world.groups, interactions_of(world))
    return TurnBasedEnv(env, hierarchy, settings.failures)


register()
