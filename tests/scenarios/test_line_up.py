"""Line-up: an ordinary scenario whose predictions come true."""

import numpy as np
import pytest

from nested_agents.core.interface.measures import measures_of
from nested_agents.core.interface.scenario import Scenario
from nested_agents.core.plugins.settings import SettingsError
from nested_agents.scenarios import SCENARIOS
from nested_agents.scenarios.line_up import LineUp, LineUpSettings


def test_it_is_a_scenario_like_any_other() -> None:
    scenario = SCENARIOS.model("line-up")(carts=3).build()
    assert isinstance(scenario, LineUp)
    assert isinstance(scenario, Scenario)
    assert scenario.recorded == ("places",)
    assert scenario.with_exact_prediction() is scenario
    assert scenario.groups == ((0,), (1,), (2,))
    assert scenario.roles == ("cart",) * 3
    assert [m.heading for m in measures_of(scenario.measures)] == [
        "success", "mean distance [m]", "spread [m]"
    ]  # fmt: skip
    scenario.reset(0)
    np.testing.assert_array_equal(scenario.measure()["places"], scenario.reset(0)[:, 0])


@pytest.mark.parametrize("carts", [0, 10_001])
def test_the_number_of_carts_is_limited(carts: int) -> None:
    with pytest.raises(SettingsError, match="carts"):
        LineUpSettings(carts=carts)


def test_the_states_of_all_agents_are_those_of_each() -> None:
    scenario = LineUpSettings(carts=3).build()
    scenario.reset(0)
    prediction, joint = scenario.predict(), np.random.default_rng(0).integers(4, size=(9, 3))
    expected = np.stack([prediction.states(agent, joint) for agent in range(3)])
    together = np.concatenate(prediction.states_by_group(joint), axis=2)
    np.testing.assert_array_equal(together, expected)
