"""Joint decisions per second of PPO in many environments, updates included.

``python -m benchmarks.many_environments`` measures chains of agents by CPU time. Linear algebra
must use one thread, as in studies: set ``OPENBLAS_NUM_THREADS=1``.
"""

from itertools import pairwise
from time import process_time

import numpy as np

from nested_agents.core.agents.loop import policy_seed
from nested_agents.core.agents.many_environments import ManyEnvironmentsLoop
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.networks.settings import HierarchyPPOSettings
from nested_agents.scenarios import SCENARIOS

CASES = (
    ("spread, 3", "spread", {}, 64, 5),
    ("spread, 3", "spread", {}, 64, 10),
    ("spread, 3", "spread", {}, 2, 10),
    ("arm of 4", "kinematic-chain", {"joints": 4}, 64, 5),
    ("arm of 4", "kinematic-chain", {"joints": 4}, 64, 10),
    ("arm of 16", "kinematic-chain", {"joints": 16}, 64, 5),
    ("box, 2", "box-pushing", {"robots": 2}, 64, 5),
    ("box, 2", "box-pushing", {"robots": 2}, 64, 10),
    ("box, 4", "box-pushing", {"robots": 4}, 64, 5),
    ("box, 8", "box-pushing", {"robots": 8, "state_space": "crowd"}, 64, 5),
)
"""Title, scenario kind, its settings, number of environments, and epochs of an update."""
TRANSITIONS = 6400
"""Joint decisions of a rollout, in all environments."""


def decisions_a_second(
    kind: str, table: dict[str, int | str], environments: int, epochs: int, *, updates: bool = True
) -> float:
    """Return joint decisions a second of processor time, over one rollout and its update."""
    world = SCENARIOS.parsed(kind, **table).build()
    agents = world.agents
    chain = Hierarchy(agents, list(pairwise(agents)))
    size = TRANSITIONS // environments
    rollout = size if updates else 2 * size
    settings = HierarchyPPOSettings(
        environments=environments, rollout=rollout, batch_size=1200, epochs=epochs, discount=0.95
    )
    team = Team(settings, world, chain, policy_seed(10_000))
    many = world.environments(environments)
    if many is None:
        raise ValueError(f"{kind}: steps one world at a time")
    loop = ManyEnvironmentsLoop(many, team, 150, 10_000)
    if updates:
        for _ in range(size):  # the first rollout compiles and makes room
            loop.step()
    else:
        loop.step()
    begin = process_time()
    steps = size if updates else size - 2
    for _ in range(steps):
        loop.step()
    return steps * environments / (process_time() - begin)


def main() -> None:
    """Print a line for every case."""
    print("case       environments epochs  decisions/s  without updates")
    for title, kind, table, environments, epochs in CASES:
        whole = decisions_a_second(kind, table, environments, epochs)
        acting = decisions_a_second(kind, table, environments, epochs, updates=False)
        print(
            f"{title:<10} {environments:>6} {epochs:>6} {np.round(whole):>12,.0f} {acting:>16,.0f}"
        )


if __name__ == "__main__":
    main()
