"""A decision in one compiled call has the bits of one that is stepped from Python."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.world import stepping, world


@pytest.fixture
def fresh():
    """Let it be found out anew whether bodies may be written to, now and afterwards."""
    stepping.step_address.cache_clear()
    yield stepping.step_address
    stepping.step_address.cache_clear()


def test_bodies_lie_where_they_are_expected(fresh) -> None:
    assert fresh() is not None, "Box2D 2.3.8, and the wheel 2.3.10"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("STEP", "_ZN7b2World4LeapEfii"),
        ("POSITION", 20),
        ("ANGLE", 52),
        ("VELOCITY", 60),
        ("TURNING", 68),
        ("FORCE", 72),
        ("FLAGS", 0),
    ],
)
def test_where_they_lie_otherwise_nothing_is_written(fresh, monkeypatch, name, value) -> None:
    monkeypatch.setattr(stepping, name, value)
    assert fresh() is None


def played(settings: BoxPushingSettings, episodes: int = 2, steps: int = 40) -> list[bytes]:
    """Return the bytes of all that comes of random actions, robots being at rest at times."""
    scenario = settings.build()
    seen = []
    for episode in range(episodes):
        seen.append(scenario.reset(episode, episode).tobytes())
        rng = np.random.default_rng(episode)
        for step in range(steps):
            actions = rng.integers(len(scenario.action_set), size=len(scenario.agents))
            if step % 20 > 12:  # Box2D lets bodies sleep after half a second
                actions[:] = scenario.action_set.neutral
                scenario.commanded_speeds[:] = 0.0
            transition = scenario.step(actions)
            whole = [transition.states, transition.reward, scenario.world.contact_time]
            whole += [scenario.world.twists, scenario.world._wrenches, scenario.world.gaps]
            seen += [np.asarray(part).tobytes() for part in whole]
    return seen


FREE = {"kind": "free", "wheels": "robot1.*", "episode": 1, "step": 5}
REVERSED = {"kind": "reversed", "wheels": "robot2.*", "episode": 0}


@pytest.mark.parametrize(
    "changes",
    [
        {"robots": 1},
        {"robots": 2, "failures": [FREE, REVERSED]},
        {"robots": 2, "box": "circle", "robot": "four-wheel"},
        {"robots": 4, "box": "L", "action_repeat": 3},
        {"robots": 8, "box": "hexagon"},
    ],
    ids=lambda changes: ", ".join(map(str, changes.values()))[:40],
)
def test_one_call_has_the_bits_of_many(changes, monkeypatch) -> None:
    settings = BoxPushingSettings.model_validate(changes)
    at_once = played(settings)
    monkeypatch.setattr(world, "step_address", lambda: None)
    assert at_once == played(settings)
