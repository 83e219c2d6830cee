"""The learned predictor: exact where the world is linear, frozen, saved, carried over."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from acting import fuzzy, look

from nested_agents.core.agents.joint import join_agents
from nested_agents.core.agents.loop import control_loop
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.prediction import states_by_group
from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.models.learned_predictor import LearnedPredictor
from nested_agents.core.models.predictors import (
    LearnedPredictorSettings,
    StaticPrediction,
)
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.checking.predictions import faults_of_prediction
from nested_agents.scenarios.kinematic_chain.config import KinematicChainSettings
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.scenarios.matrix_games.scenario import MatrixGameSettings
from nested_agents.topologies.config import build

LEARNED = LearnedPredictorSettings(ridge=1e-6)


class Rails(Scenario):
    """Sledges on rails: each is driven by its own speed, and drags every other by a tenth.

    Their places wrap at 10 m. `predict` is missing: nothing but the learned predictor knows.
    """

    def __init__(
        self, n: int = 2, names: tuple[str, ...] | None = None, limit: float = 1.0
    ) -> None:
        self.agents = tuple(f"sledge{i}" for i in range(n))
        self.roles = names or ("sledge",) * n
        self.limit = limit
        self.action_set = ActionSet()
        speed = Variable("speed", "m/s", -1.0, 1.0, centers=(-1.0, -0.5, 0.0, 0.5, 1.0))
        place = Variable("place", "m", -5.0, 5.0, periodic=True)
        total = Variable("total", "m/s", -4.0, 4.0)
        self.state_space = StateSpace("rails", (speed, place, total), 1, ("total",))

    def reset(self, seed: Any, episode: int = 0) -> np.ndarray:
        rng = np.random.default_rng(seed)
        self.speeds, self.places = np.zeros(len(self.agents)), rng.uniform(-5, 5, len(self.agents))
        return self.seen()

    def step(self, joint_action: np.ndarray) -> Transition:
        half, limit = np.full(len(self.agents), 0.5), np.full(len(self.agents), self.limit)
        self.speeds = self.action_set.apply(self.speeds, joint_action, half, limit)
        moved = 0.9 * self.speeds + 0.1 * self.speeds.sum()
        self.places = (self.places + moved + 5.0) % 10.0 - 5.0
        return Transition(self.seen(), 0.0, False, False, {})

    def seen(self) -> np.ndarray:
        total = np.full(len(self.agents), self.speeds.sum())
        return np.stack([self.speeds, self.places, total], axis=1)


def trained(
    scenario: Any, settings: LearnedPredictorSettings = LEARNED, decisions: int = 300
) -> tuple[LearnedPredictor, np.ndarray]:
    """Return a predictor that has seen random actions, and the states that they ended in."""
    predictor, rng = LearnedPredictor(settings, scenario), np.random.default_rng(0)
    states = scenario.reset(0)
    for k in range(decisions):
        joint = rng.integers(len(scenario.action_set), size=len(scenario.agents))
        after = np.asarray(scenario.step(joint).states)
        predictor.observe(states, joint, after)
        states = after if (k + 1) % 40 else scenario.reset(k)
    predictor.end_episode()
    return predictor, states


@pytest.mark.parametrize("roles", [("sledge",) * 3, ("a", "b", "c")], ids=["alike", "unlike"])
def test_a_linear_world_is_predicted_to_rounding(roles: tuple[str, ...]) -> None:
    scenario = Rails(3, roles)
    predictor, states = trained(scenario)
    rng = np.random.default_rng(1)
    for _ in range(5):
        joint = rng.integers(4, size=3)
        prediction = predictor.predict(states)
        guessed = np.array([prediction.states(i, joint[None])[0] for i in range(3)])
        states = scenario.step(joint).states
        assert guessed == pytest.approx(states, abs=1e-4)


def test_own_variables_are_rounded_to_a_thousandth_of_their_range() -> None:
    predictor, _ = trained(Rails(2))  # speeds from -1 to 1 m/s
    steps = predictor.reached(np.array([[0.1234, 0.0, 0.0], [-0.3217, 0.0, 0.0]])) / 0.002
    np.testing.assert_allclose(steps, np.round(steps), rtol=0, atol=1e-9)


def test_what_is_held_goes_on_and_angles_wrap() -> None:
    scenario = Rails(1)
    predictor, _ = trained(scenario, LEARNED.model_copy(update={"horizon": 3}))
    ahead = predictor.predict(np.array([[0.5, 4.0, 0.5]])).states(0, np.array([[0], [3]]))
    # At 1 m/s for three decisions from 4 m: 7 m, which is -3; braked to a stand: where it was.
    assert ahead == pytest.approx(np.array([[1.0, -3.0, 1.0], [0.0, 4.0, 0.0]]), abs=1e-3)


class Springs(Rails):
    """A sledge whose speed is worth more where the middle of its way is farther to the right."""

    def reset(self, seed: Any, episode: int = 0) -> np.ndarray:
        super().reset(seed)
        self.places *= 0.4
        return self.seen()

    def step(self, joint_action: np.ndarray) -> Transition:
        before = self.places
        super().step(joint_action)
        driven = 0.2 * self.speeds
        # The way is driven * (1 + 0.4 * (before + after) / 2).
        self.places = (before + driven * (1.0 + 0.2 * before)) / (1.0 - 0.2 * driven)
        return Transition(self.seen(), 0.0, False, False, {})


def test_what_moves_what_is_taken_from_the_middle_of_the_way() -> None:
    errors = {}
    for midpoint in (False, True):
        settings = LEARNED.model_copy(update={"midpoint": midpoint})
        predictor, _ = trained(Springs(1), settings)
        # From 1 m at 1 m/s: (1 + 0.2 * 1.2) / 0.96 = 1.2917 m.
        ahead = predictor.predict(np.array([[0.5, 1.0, 0.5]])).states(0, np.array([[0]]))
        errors[midpoint] = abs(ahead[0, 1] - 1.2917)
    assert errors[True] < 2e-4 < 2e-3 < errors[False]


def test_before_any_experience_nothing_changes() -> None:
    states = np.array([[0.5, 4.0, 0.2], [0.0, 1.0, 0.2]])
    joint = np.array([[0, 1], [2, 3]])
    learned = LearnedPredictor(LEARNED, Rails())
    for prediction in (learned.predict(states), StaticPrediction(states)):
        for agent in range(2):
            assert prediction.states(agent, joint) == pytest.approx(states[[agent] * 2])


def test_the_smaller_residual_decides_between_change_and_value() -> None:
    predictor, _ = trained(Rails())
    # The place is an angle and always changes; the total follows from the speeds, whatever it was.
    assert predictor.memory["keep"].tolist() == [1.0, 0.0]


def test_what_was_not_seen_is_not_predicted() -> None:
    predictor, _ = trained(Rails(limit=0.5))
    assert predictor.memory["seen"][:, 2].tolist() == [-1.0, 1.0]
    ahead = predictor.predict(np.array([[1.0, 0.0, 0.9], [1.0, 0.0, 0.9]]))
    assert ahead.states(0, np.array([[0, 0]]))[0, 2] <= 1.0


WORLDS: dict[str, Callable[[], Scenario]] = {
    "boxes": BoxPushingSettings().build,
    "bodies": lambda: join_agents(BoxPushingSettings().build(), "body"),
    "paper": BoxPushingSettings(state_space="paper").build,
    "arm": KinematicChainSettings(joints=3).build,
    "long arm": KinematicChainSettings(joints=8).build,
    "carts": LineUpSettings(carts=2).build,
    "game": MatrixGameSettings().build,
}


class Predicting(Scenario):
    """A scenario whose prediction is the learned one, for the checks of predictions."""

    def __init__(self, scenario: Any, predictor: LearnedPredictor, states: np.ndarray) -> None:
        self.__dict__.update(vars(scenario))
        for name in ("agents", "state_space", "action_set", "groups"):
            if hasattr(scenario, name):
                setattr(self, name, getattr(scenario, name))
        self.prediction = predictor.predict(states)

    def reset(self, seed: Any, episode: int = 0) -> Any:
        raise NotImplementedError

    def step(self, joint_action: Any) -> Transition:
        raise NotImplementedError

    def predict(self) -> Any:
        return self.prediction


@pytest.mark.parametrize("world", WORLDS)
def test_predictions_agree_with_each_other_in_any_world(world: str) -> None:
    scenario = WORLDS[world]()
    settings = LearnedPredictorSettings(products="none")
    predictor, states = trained(scenario, settings, decisions=60)
    rng = np.random.default_rng(2)
    joint = rng.integers(len(scenario.action_set), size=(7, len(scenario.agents)))
    there = Predicting(scenario, predictor, states)
    assert next(faults_of_prediction(there, joint, rng), None) is None  # type: ignore[arg-type]


def test_actions_that_reach_the_same_are_alike() -> None:
    predictor, _ = trained(Rails())
    alike = predictor.predict(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])).alike
    # At rest maintaining and zeroing are one; at the limit increasing and maintaining.
    assert alike.tolist() == [[0, 1, 2, 2], [0, 1, 0, 3]]


def team_of(scenario: Any, seed: int = 0, **settings: Any) -> Team:
    table = {"predictor": {"kind": "learned", "products": "none"}, **settings}
    learner = BatchTDSettings.model_validate(table)
    hierarchy = build("chain", scenario.agents)
    return Team(learner, scenario, hierarchy, np.random.SeedSequence(seed))


def episodes(scenario: Any, team: Team, count: int, **options: Any) -> list[list[int]]:
    loop = control_loop(scenario, team, episodes=count, steps=15, seed=3, **options)
    return [record.joint_action.tolist() for record in loop]


def test_it_is_frozen_in_evaluation_and_saved_with_the_team() -> None:
    scenario, team = Rails(), team_of(Rails())
    episodes(scenario, team, 3)
    kept = {name: array.copy() for name, array in team.state_dict().items()}
    assert kept["predictor.gram"].any()
    episodes(scenario, team, 1, learn=False)
    assert np.array_equal(team.state_dict()["predictor.gram"], kept["predictor.gram"])
    other = team_of(Rails(), seed=1)
    other.load_state_dict(kept)
    ours, theirs = ({k: v.copy() for k, v in t.state_dict().items()} for t in (team, other))
    del ours["generator"], theirs["generator"]
    assert all(np.array_equal(ours[name], theirs[name]) for name in ours)


def test_a_restored_team_goes_on_to_the_same_bits() -> None:
    whole, first, second = (team_of(Rails()) for _ in range(3))
    every = episodes(Rails(), whole, 4)
    begun = episodes(Rails(), first, 2)
    state = {name: array.copy() for name, array in first.state_dict().items()}
    second.load_state_dict(state)
    assert begun + episodes(Rails(), second, 2, first_episode=2) == every
    assert np.array_equal(
        fuzzy(whole).model.predictor.memory["weights"],
        fuzzy(second).model.predictor.memory["weights"],
    )  # type: ignore[union-attr]


def test_more_bodies_go_on_with_what_fewer_have_learned() -> None:
    predictor, _ = trained(Rails(2))
    larger = LearnedPredictor(LEARNED, Rails(4))
    larger.warm_start(predictor)
    ahead = larger.predict(np.zeros((4, 3))).states(0, np.array([[0, 0, 2, 2]]))
    assert ahead[0] == pytest.approx([0.5, 0.9 * 0.5 + 0.1 * 1.0, 1.0], abs=1e-4)
    of_others = LearnedPredictor(LEARNED, LineUpSettings(carts=2).build())
    of_others.warm_start(predictor)
    assert not of_others.memory["gram"].any()


def test_the_image_in_the_mirror_is_experience() -> None:
    scenario = KinematicChainSettings(joints=2).build()
    plain = LearnedPredictor(LearnedPredictorSettings(mirrored=False), scenario)
    double = LearnedPredictor(LearnedPredictorSettings(), scenario)
    before = scenario.reset(0)
    joint = np.array([0, 1])
    after = np.asarray(scenario.step(joint).states)
    for predictor in (plain, double):
        predictor.observe(before, joint, after)
        predictor.end_episode()
    # Of what moves bodies; what an action is in the mirror, and so of own variables, is not known.
    assert double.memory["own_gram"].sum() == plain.memory["own_gram"].sum() == 2.0
    of_one, of_both = (predictor.memory["squares"][:3] for predictor in (plain, double))
    assert of_both == pytest.approx(2.0 * of_one)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"self_model": {"enabled": True}}, r"learner.self_model.enabled: .* use 'given'"),
        ({"calibration": {"enabled": True}}, r"learner.calibration.enabled: .* use 'given'"),
    ],
)
def test_nothing_of_the_given_predictor_is_revised_beside_it(
    settings: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        team_of(BoxPushingSettings().build(), **settings)


def test_what_it_cannot_regress_is_refused() -> None:
    four = BoxPushingSettings(robot="four-wheel").build()
    with pytest.raises(
        ValueError,
        match=r"^learner.predictor: needs \d+ regression features, .* reduce products or",
    ):
        LearnedPredictor(LearnedPredictorSettings(memberships=15), four)
    alone = Rails()
    alone.state_space = StateSpace("alone", alone.state_space.variables, 3)
    with pytest.raises(ValueError, match="has no shared variables"):
        LearnedPredictor(LEARNED, alone)
    with pytest.raises(ValueError, match="declares no mirror symmetry"):
        LearnedPredictor(LearnedPredictorSettings(mirrored=True), Rails())


def test_rewards_are_not_predicted() -> None:
    team = team_of(Rails(), decision={"rule": "reward"})
    with pytest.raises(ValueError, match=r"decision.rule = 'reward': no rewards"):
        team.check(look(Rails()))


def test_states_by_group_are_those_of_all() -> None:
    predictor, states = trained(Rails(3))
    joint = np.array([[0, 1, 2], [3, 3, 0]])
    own, shared = states_by_group(predictor.predict(states), joint, Rails(3).groups, 1)  # type: ignore[arg-type]
    assert own.shape, shared.shape == ((3, 2, 1), (3, 2, 2))
