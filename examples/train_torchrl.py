"""
Train MAPPO of TorchRL in any of our environments
=================================================

Every agent is a player in a registered PettingZoo environment. Actors share their weights, and one
critic sees all states. Needs ``pip install torchrl``. Then run ``python train_torchrl.py``, or give
a number of joint steps and the id of another environment: ``python train_torchrl.py 100000
NestedAgents/Arm-v0``.
"""

import sys

import pettingzoo
import torch
from tensordict.nn import TensorDictModule
from torchrl.envs import PettingZooWrapper, RewardSum, TransformedEnv
from torchrl.modules import MultiAgentMLP, ProbabilisticActor
from torchrl.objectives import ClipPPOLoss, ValueEstimators

from nested_agents.environments import env_id

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 40_000
WORLD = sys.argv[2] if len(sys.argv) > 2 else env_id("LineUp")
BATCH = 1000
"""Joint steps between updates."""
EPOCHS = 10
MINIBATCH = 250
EPISODES = 20
torch.set_num_threads(1)  # networks this small are fastest so
torch.manual_seed(0)

world = pettingzoo.make("parallel", WORLD)
n_agents = len(world.possible_agents)
env = TransformedEnv(
    PettingZooWrapper(world, group_map={"team": world.possible_agents}, categorical_actions=True),
    RewardSum([("team", "reward")], [("team", "episode_reward")]),
)
env.set_seed(0)
width = env.observation_spec["team", "observation"].shape[-1]
n_actions = world.action_space(world.possible_agents[0]).n


def network(outputs: int, key: str, *, sees_all: bool) -> TensorDictModule:
    """Return a network with an output for every agent; all agents share its weights."""
    layers = MultiAgentMLP(
        width, outputs, n_agents, centralised=sees_all, share_params=True, depth=2, num_cells=64
    )
    return TensorDictModule(layers, [("team", "observation")], [("team", key)])


actor = ProbabilisticActor(
    network(n_actions, "logits", sees_all=False),
    in_keys=[("team", "logits")],
    out_keys=[env.action_key],
    distribution_class=torch.distributions.Categorical,
    return_log_prob=True,
    log_prob_key=("team", "log_prob"),
)
loss = ClipPPOLoss(actor, network(1, "state_value", sees_all=True), entropy_coeff=0.01)
loss.set_keys(
    reward=("team", "reward"),
    action=env.action_key,
    value=("team", "state_value"),
    sample_log_prob=("team", "log_prob"),
    done=("team", "done"),
    terminated=("team", "terminated"),
)
loss.make_value_estimator(ValueEstimators.GAE, gamma=0.95, lmbda=0.9)
optimizer = torch.optim.Adam(loss.parameters(), lr=1e-3)


def report(when: str) -> None:
    """Play episodes with the policy as it is, and print how they go."""
    with torch.no_grad():
        plays = [env.rollout(1_000, actor) for _ in range(EPISODES)]
    sums = torch.stack([play["next", "team", "episode_reward"][-1].mean() for play in plays])
    print(f"{when}: sum of rewards {sums.mean():.3f} +- {sums.std():.3f} in {WORLD}")


report("before training")
done = 0
while done < STEPS:
    with torch.no_grad():
        batch = env.rollout(BATCH, actor, break_when_any_done=False)
        loss.value_estimator(batch)
    done += BATCH
    for _ in range(EPOCHS):
        for rows in torch.randperm(BATCH).split(MINIBATCH):
            losses = loss(batch[rows])
            total = losses["loss_objective"] + losses["loss_critic"] + losses["loss_entropy"]
            optimizer.zero_grad()
            total.backward()
            torch.nn.utils.clip_grad_norm_(loss.parameters(), 1.0)
            optimizer.step()
report(f"after {done} joint steps")
