"""PPO in a hierarchy: who is told what, one reward per joint step, what edges are worth."""

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.scenario import Transition
from nested_agents.core.learners import LEARNERS
from nested_agents.core.networks.peer import Passing, Seen
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session, arrange, check, run_trial
from nested_agents.studies.trials.trial import trials_of

SHORT = {"kind": "hierarchy-ppo", "rollout": 16, "batch_size": 8, "epochs": 2}
CARTS = 4
TREE = [("a", "b"), ("a", "c"), ("b", "d")]


def spec_of(topology: Any = "chain", **learner: Any) -> Spec:
    return Spec.of(
        {
            "study": "peers", "seeds": [10_000], "episodes": 3, "steps": 20, "evaluation": 2,
            "scenario": {"kind": "line-up", "carts": CARTS}, "topology": topology,
            "learner": {**SHORT, **learner},
        }
    )  # fmt: skip


def peer_of(scenario: Any, hierarchy: Hierarchy | None, seed: int = 0, **table: Any) -> Any:
    settings = LEARNERS.model("hierarchy-ppo").model_validate({**SHORT, **table})
    return settings.build(scenario, np.random.SeedSequence(seed), hierarchy)


def sequence(scenario: Any, peer: Any, steps: int) -> None:
    states = scenario.reset(1)
    for _ in range(steps):
        transition = scenario.step(peer.act(Seen(states, scenario)))
        peer.learn(transition)
        states = transition.states


def test_turns_and_messages_by_hand() -> None:
    tree = Passing(Hierarchy("abcd", TREE), n_actions=3, rows=np.array([0, 0, 1, 0]))
    assert [t.weights for t in tree.turns] == [0, 0, 1, 0]
    assert [t.told.tolist() for t in tree.turns] == [[1, 2, 3], [3], [], []]
    assert tree.width == 6  # of a and b; nobody is told by c or d
    told, joint = np.zeros((4, 6)), np.array([2, 0, 1, 1])
    for turn in tree.turns:
        tree.tell(turn, joint, told)
    by_a, by_b = [0, 0, 1], [1, 0, 0]
    assert told.tolist() == [[0] * 6, by_a + [0] * 3, by_a + [0] * 3, by_a + by_b]


def test_parents_alone_are_heard() -> None:
    rows = np.zeros(3, dtype=int)
    chain = Passing(Hierarchy("abc", pairwise("abc"), told="parents"), 2, rows)
    assert [turn.told.tolist() for turn in chain.turns] == [[1], [2], []]
    silent = Passing(Hierarchy("abc", pairwise("abc"), told="none"), 2, rows)
    assert ([turn.agents for turn in silent.turns], silent.width) == ([slice(0, 3)], 0)


@pytest.mark.parametrize("weights", ["all", "role", "own"])
@pytest.mark.parametrize("critic", ["central", "own"])
def test_the_masked_pass_has_the_probabilities_of_acting(weights: str, critic: str) -> None:
    torch: Any = pytest.importorskip("torch", reason="extra [peers]")
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    scenario = LineUpSettings(carts=CARTS).build()
    hierarchy = Hierarchy(scenario.agents, pairwise(scenario.agents))
    peer = peer_of(scenario, hierarchy, weights=weights, critic=critic)
    assert len(peer.parts) == {"all": 1, "role": 1, "own": CARTS}[weights]
    sequence(scenario, peer, 24)  # updated after 16, and 8 steps are in the buffers
    for part in peer.parts.values():
        buffer, n = part.model.rollout_buffer, len(part.agents)
        assert buffer.pos == 8
        told = buffer.observations[:8, :, : peer.passing.width]
        for row, agent in enumerate(part.agents):
            assert (told[:, row].sum(axis=1) == len(hierarchy.above(agent))).all()
        # The first of the eight was decided before the update.
        seen = torch.as_tensor(buffer.observations[1:8].reshape(7 * n, -1))
        actions = torch.as_tensor(buffer.actions[1:8].reshape(-1))
        values, logs, _ = part.model.policy.evaluate_actions(seen, actions)
        for ours, theirs in ((buffer.log_probs, logs), (buffer.values, values)):
            assert ours[1:8].ravel() == pytest.approx(theirs.detach().numpy().ravel(), abs=1e-5)


def test_permuting_agents_permutes_results() -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    first = LineUpSettings(carts=CARTS).build()
    n, n_actions, names = CARTS, len(first.action_set), first.agents
    order = [2, 0, 3, 1]  # who stands at each place in the second
    edges = [(names[0], names[1]), (names[1], names[2]), (names[2], names[3])]
    second: Any = SimpleNamespace(
        agents=tuple(names[i] for i in order), action_set=first.action_set,
        state_space=first.state_space,
    )  # fmt: skip
    one = peer_of(first, Hierarchy(first.agents, edges), critic="own")
    other = peer_of(second, Hierarchy(second.agents, edges), critic="own")
    heard = [[0, 1, 2], [i for i in order if i != 3]]
    told = [n_actions * heard[0].index(i) + a for i in heard[1] for a in range(n_actions)]
    n_states = one.inputs.n_own - n
    columns = [*told, *(len(told) + k for k in range(n_states))]
    columns += [len(told) + n_states + i for i in order]
    theirs = dict(one.parts["all"].model.policy.state_dict())
    first_layer = "mlp_extractor.policy_net.0.weight"
    theirs[first_layer] = theirs[first_layer][:, columns]
    other.parts["all"].model.policy.load_state_dict(theirs)
    states = first.reset(4)
    noise = np.random.default_rng(0).gumbel(size=(n, n_actions))
    _, logits, joint = one.decide(states, noise)
    _, permuted, acted = other.decide(states[order], noise[order])
    assert permuted == pytest.approx(logits[order], abs=1e-6)
    assert (acted == joint[order]).all()


def test_a_joint_step_has_one_reward_for_all() -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    scenario = LineUpSettings(carts=CARTS).build()
    for value_of, spread in (("team", 0.0), ("own", 1.0)):
        peer = peer_of(scenario, None, value_of=value_of)
        peer.act(Seen(scenario.reset(1), scenario))
        own = np.arange(CARTS, dtype=float)
        peer.learn(Transition(scenario.reset(1), own, False, False, {}))
        rewards = peer.parts["all"].model.rollout_buffer.rewards[0]
        assert (np.ptp(rewards) > 0) == (spread > 0)


def test_without_edges_it_is_mappo_and_by_own_critics_ippo() -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    told_nothing = [{"topology": "independent"}, {"topology": {"kind": "chain", "told": "none"}}]
    for kind, critic in (("mappo", "central"), ("ippo", "own")):
        (trial,) = trials_of(spec_of(kind=kind))
        rows = run_trial(trial).rows
        for table in told_nothing:
            (like,) = trials_of(spec_of(**table, critic=critic, value_of="own"))
            assert run_trial(like).rows == rows
        (chain,) = trials_of(spec_of(critic=critic, value_of="own"))
        assert run_trial(chain).rows != rows


def test_policies_of_probabilities_are_evaluated_by_sampled_actions_too() -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    session = Session(trials_of(spec_of())[0])
    session.train(1)
    state = fuzzy(session.team).rng.bit_generator.state
    session.run_other_evaluations()
    assert fuzzy(session.team).rng.bit_generator.state == state
    phases = [row.phase for row in session.result().rows]
    assert phases == ["training", "evaluation:sampled actions", "evaluation:sampled actions"]


@pytest.mark.parametrize(
    ("topology", "problem"),
    [
        ("simultaneous", "neighbours decide at the same time and tell each other nothing"),
        ({"kind": "chain", "failures": [{"kind": "lost", "agents": "*"}]}, "topology.failures: "),
    ],
)
def test_what_cannot_be_passed_down_is_refused(topology: Any, problem: str) -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    with pytest.raises(SpecError, match=problem) as raised:
        check(spec_of(topology))
    assert "\n" not in str(raised.value)


def test_a_topology_that_says_nothing_to_the_learner_is_remarked() -> None:
    considering = {"kind": "chain", "considers": "none", "told": "parents"}
    assert spec_of().warnings() == spec_of("tree").warnings() == ()
    assert spec_of(considering).warnings() == (
        "topology.considers: left out, learner.kind = 'hierarchy-ppo' considers nobody",
    )
    assert spec_of("tree", kind="mappo").warnings() == (
        "topology: left out, learner.kind = 'mappo' passes no actions down",
    )


MINE = """
from typing import ClassVar
import nested_agents as na

class Mine(na.Peer):
    class Settings(na.PeerSettings):
        uses_hierarchy: ClassVar[bool] = USES

    def __init__(self, settings, scenario, seed, hierarchy=None):
        super().__init__(seed)
        self.hierarchy = hierarchy
"""
SPEC = """
scenario.kind = "line-up"
topology = {kind = "tree", told = "parents"}
learner.kind = "mine.py:Mine"
"""


@pytest.mark.parametrize("uses", [True, False])
def test_a_learner_of_ones_own_is_given_the_hierarchy_if_it_asks(
    tmp_path: Path, uses: bool
) -> None:
    (tmp_path / "mine.py").write_text(MINE.replace("USES", str(uses)), encoding="utf-8")
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    spec = Spec.load(tmp_path / "spec.toml")
    with spec.sources.active():
        team: Any = arrange(spec.conditions()[0].settings, 0).team
    assert (team.hierarchy.told if uses else team.hierarchy) == ("parents" if uses else None)
    assert [line[:18] for line in spec.warnings()] == ([] if uses else ["topology: left out"])


@pytest.mark.slow
@pytest.mark.parametrize("game", ["climbing", "penalty:-30"])
def test_a_chain_finds_the_optimum_of_games_where_independent_agents_do_not(game: str) -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    table = {
        "study": "games", "seeds": [0, 1, 2], "episodes": 5, "steps": 1000, "evaluation": 1,
        "scenario": {"kind": "matrix-game", "game": game, "observed": "own"},
        "learner": {"kind": "hierarchy-ppo", "discount": 0.0},
        "sweep": {"topology": ["chain", "independent"]},
    }  # fmt: skip
    rates: dict[str, list[float]] = {"chain": [], "independent": []}
    for trial in trials_of(Spec.of(table)):
        rows = run_trial(trial).rows
        last = next(row for row in rows if row.phase == "evaluation")
        rates[trial.settings.topology.kind].append(last.measures["success"])
    assert rates == {"chain": [1, 1, 1], "independent": [0, 0, 0]}
