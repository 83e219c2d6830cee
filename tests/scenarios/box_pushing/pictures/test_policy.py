import numpy as np
import pytest
from acting import fuzzy, joint_of

from nested_agents.scenarios.box_pushing.pictures.policy import Field
from nested_agents.studies.spec.conditions import ConditionSettings
from nested_agents.studies.trials.arrangement import arrange


@pytest.mark.parametrize(("slope", "to_the_box"), [(-1.0, True), (1.0, False)])
def test_a_team_that_likes_the_box_drives_to_it(slope, to_the_box):
    _, scenario, team = arrange(ConditionSettings(), 0)
    partitions = fuzzy(team).evaluator.rules.partitions
    gap = [v.name for v in scenario.state_space.variables].index("gap")
    begin = sum(p.size for p in partitions[:gap])
    fuzzy(team).learner.theta[:, begin : begin + partitions[gap].size] = slope * np.array(
        partitions[gap].centres
    )
    fields = scenario.show_policy(
        lambda prediction: joint_of(team, scenario, explore=False, imagined=prediction),
        scenario.predict,
    ).fields
    assert len(fields) == 2
    for field in fields:
        far = np.hypot(*field.points[:, :2].T) > 0.25
        toward = np.array([move == "to the box" for move in field.moves])[far]
        assert toward.mean() > 0.9 if to_the_box else toward.mean() < 0.1


def test_sides_are_named_counter_clockwise():
    points = np.array([[-1, 0.1, 0], [0, -1, 0], [1, 0, 0], [0, 1, 0], [-1, -0.1, 0]])
    zeros = np.zeros(5)
    field = Field(0, points, np.zeros((5, 2)), zeros, np.zeros((0, 2)))
    assert field.sides == ["behind", "right", "ahead", "left", "behind"]
    assert field.moves == ["rests"] * 5
