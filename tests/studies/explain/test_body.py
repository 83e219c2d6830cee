import numpy as np

from nested_agents.core.models.self_model import SelfModel, SelfModelSettings
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS, nominal_effect
from nested_agents.studies.explain.text import changes

FOUR = nominal_effect(ROBOTS["four-wheel"])
AGENTS = [f"robot{r}.{name}" for r in (1, 2) for name in ROBOTS["four-wheel"].wheel_names]


def bodies_of(*factors, deviation=0.01):
    """Two robots, of which the first one's wheels drive by these factors."""
    changed = FOUR.copy()
    changed[:, :4] *= factors
    small = deviation * np.abs(FOUR)
    return [(FOUR, changed, small), (FOUR, FOUR, small)]


def test_changed_wheels_are_named_with_their_drive():
    assert list(changes(bodies_of(1.0, 0.02, -1.0, 0.5), AGENTS)) == [
        "robot1.front-right: +0.02 ± 0.01 of its drive, as if it did not drive",
        "robot1.rear-left: -1.00 ± 0.01 of its drive, as if it were reversed",
        "robot1.rear-right: +0.50 ± 0.01 of its drive, as if it were weak",
    ]


def test_small_changes_are_left_out_and_uncertain_ones_marked():
    assert list(changes(bodies_of(1.1, 0.9, 1.0, 1.0), AGENTS)) == []
    (line,) = changes(bodies_of(0.2, 1.0, 1.0, 1.0), AGENTS)
    assert line.endswith("as if it were weak")
    (line,) = changes(bodies_of(0.5, 1.0, 1.0, 1.0, deviation=0.4), AGENTS)
    assert line.endswith("uncertain")


def test_a_seized_wheel_is_found_by_its_self_model():
    model = SelfModel(SelfModelSettings(enabled=True), [FOUR])
    rng = np.random.default_rng(0)
    seized = FOUR.copy()
    seized[:, 2] = 0.0
    for _ in range(60):
        speeds = rng.uniform(-0.13, 0.13, size=4)
        model.observe(0, speeds, seized @ [*speeds, 1.0])
    (line,) = changes([(FOUR, model.effects[0], model.deviations[0])], AGENTS[:4])
    assert line.startswith("robot1.rear-left: +0.0")
    assert "uncertain" not in line
