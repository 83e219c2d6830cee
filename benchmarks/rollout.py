"""What `mujoco.rollout` would save, and what it does not know: ``python -m benchmarks.rollout``.

A copied simulator is stepped for every joint action that is tried, three decisions ahead. Against
it stands MuJoCo's own batch: it plays the physics of all joint actions in one call; then the
environment observes each end. The batch is given what it lacks: rewards are left out of it, and it
goes on after an episode has ended. How far its states are off says whether that was so. Needs the
extra mujoco.
"""

from __future__ import annotations

import argparse
from itertools import product
from time import thread_time
from typing import Any

import numpy as np

from nested_agents.scenarios.adapters.settings import GymnasiumSettings

from .timing import paired

TRIED = 27
"""Joint actions, at most."""
LEVELS, HOLD, HORIZON = 3, 3, 3


def main() -> None:
    """Print a line for each environment."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--ids", nargs="+", default=["Swimmer-v5", "HalfCheetah-v5", "Hopper-v5"], metavar="ID"
    )
    parser.add_argument("--budget", type=float, default=2.0, help="seconds for each")
    arguments = parser.parse_args()
    for name in arguments.ids:
        compare(name, arguments.budget)


def compare(name: str, budget: float) -> None:
    """Print how much longer copies take than a batch, and how far apart their states are."""
    from mujoco import MjData, mj_getState, mj_stateSize, mjtState, rollout

    world: Any = GymnasiumSettings(
        id=name, actions=LEVELS, hold=HOLD, horizon=HORIZON, predictor="copy"
    ).build()
    rng = np.random.default_rng(0)
    n = len(world.agents)
    every = np.array(list(product(range(LEVELS), repeat=n)))
    joint = every[rng.permutation(len(every))[:TRIED]]
    world.reset(0)
    for _ in range(5):
        world.step(rng.integers(LEVELS, size=n))
    env = world._simulator.env.unwrapped
    model, data, scratch = env.model, env.data, MjData(env.model)
    steps, whole = HORIZON * HOLD * env.frame_skip, mjtState.mjSTATE_FULLPHYSICS
    present = np.zeros(mj_stateSize(model, whole))
    torques = np.array([world._actuators.commands(row)[""] for row in joint])
    held = np.repeat(torques[:, None], steps, axis=1)

    def copies() -> Any:
        return world.predict().states(0, joint)

    def batch() -> Any:
        mj_getState(model, data, present, whole)
        ahead, _ = rollout.rollout(model, scratch, np.tile(present, (len(joint), 1)), held)
        saved, states = (data.qpos.copy(), data.qvel.copy()), []
        for end in ahead[:, -1]:
            data.qpos[:], data.qvel[:] = np.split(end[1 : 1 + model.nq + model.nv], [model.nq])
            states.append(world.states_of({"": env._get_obs()})[0])
        data.qpos[:], data.qvel[:] = saved
        return np.array(states)

    off = np.abs(copies() - batch()).max()
    times = paired({"copies": copies, "batch": batch}, budget=budget, clock=thread_time)
    print(
        f"{name}: {len(joint)} joint actions, copies {1e3 * times.median('copies'):.1f} ms, "
        f"{times.ratio('copies', 'batch'):.2f} of the batch; states off by {off:.2g}"
    )


if __name__ == "__main__":
    main()
