import numpy as np
import pytest
from acting import fuzzy, joint_of

from nested_agents.scenarios.box_pushing.pictures.policy import MotionField
from nested_agents.studies.spec.conditions import ConditionSettings
from nested_agents.studies.trials.arrangement import arrange


@pytest.mark.parametrize(("slope", "to_the_box"), [(-1.0, True), (1.0, False)])
def test_a_team_that_likes_the_box_drives_to_it(slope, to_the_box):
    _, scenario, team = arrange(ConditionSettings(), 0)
    partitions = fuzzy(team).evaluator.rules.partitions
    gap = [v.name for v in scenario.state_space.variables].index("gap")
    begin = sum(p.size for p in partitions[:gap])
    fuzzy(team).learner.theta[:, begin : begin + partitions[gap].size] = slope * np.array(
        partitions[gap].centers
    )
    fields = scenario.show_policy(
        lambda prediction: joint_of(team, scenario, explore=False, prediction=prediction),
        scenario.predict,
    ).fields
    assert len(fields) == 2
    for field in fields:
        far = np.hypot(*field.points[:, :2].T) > 0.25
        toward = np.array([kind == "to the box" for kind in field.kinds])[far]
        assert toward.mean() > 0.9 if to_the_box else toward.mean() < 0.1


def test_kinds_of_motion():
    points = np.zeros((4, 3))
    motions = np.array([[0.01, 0.0, 0.3], [-0.01, 0.0, 0.0], [0.001, 0.0, -0.2], [0.0, 0.0, 0.01]])
    field = MotionField(points, motions, np.zeros((0, 2)))
    assert field.kinds == ["to the box", "away", "turns", "rests"]
