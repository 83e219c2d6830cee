import numpy as np

from nested_agents.core.models.self_model import SelfModel, SelfModelSettings
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS, nominal_effect
from nested_agents.studies.explain.team import BodyEffects
from nested_agents.studies.explain.text import effects_table, verdicts

FOUR = nominal_effect(ROBOTS["four-wheel"])
AGENTS = [f"robot{r}.{name}" for r in (1, 2) for name in ROBOTS["four-wheel"].wheel_names]


def bodies_of(*factors):
    """Two robots, of which the first one's wheels drive by these factors."""
    changed = FOUR.copy()
    changed[:, :4] *= factors
    small = 0.01 * np.abs(FOUR)
    return BodyEffects({"built": (FOUR, FOUR), "after": (changed, FOUR)}, (small, small))


def test_wheels_are_taken_for_what_they_do():
    assert list(verdicts(bodies_of(1.0, 0.02, -1.0, 0.5), AGENTS)) == [
        "robot1.front-right: +0.02 ± 0.01 of its drive, as if it did not drive",
        "robot1.rear-left: -1.00 ± 0.01 of its drive, as if it were reversed",
        "robot1.rear-right: +0.50 ± 0.01 of its drive, as if it were weak",
    ]


def test_healthy_wheels_are_passed_over_and_doubt_is_said():
    assert list(verdicts(bodies_of(1.1, 0.9, 1.0, 1.0), AGENTS)) == []
    doubtful = bodies_of(0.5, 1.0, 1.0, 1.0)
    doubtful.deviations = (np.full_like(FOUR, 1.0),) * 2
    (said,) = verdicts(doubtful, AGENTS)
    assert said.endswith("as if it were weak; uncertain")


def test_a_seized_wheel_is_found_by_its_self_model():
    model = SelfModel(SelfModelSettings(enabled=True), [FOUR])
    bodies = BodyEffects({}, ())
    bodies.note("built", model)
    rng = np.random.default_rng(0)
    seized = FOUR.copy()
    seized[:, 2] = 0.0
    for _ in range(60):
        speeds = rng.uniform(-0.13, 0.13, size=4)
        model.observe(0, speeds, seized @ [*speeds, 1.0])
    bodies.note("after", model)
    (said,) = verdicts(bodies, AGENTS[:4])
    assert said.startswith("robot1.rear-left: +0.0")
    assert "uncertain" not in said


def test_the_table_fits_80_columns_with_six_wheels():
    six = ROBOTS["six-wheel"]
    effect = nominal_effect(six)
    bodies = BodyEffects({m: (effect,) for m in ("built", "before", "after")}, (0 * effect,))
    lines = effects_table(bodies, [f"robot1.{name}" for name in six.wheel_names]).splitlines()
    assert max(len(line.rstrip()) for line in lines) <= 80
    assert lines[0].split()[:2] == ["front-left", "front-right"]
    assert [line.split()[0] for line in lines[1:5]] == ["robot1", "before", "after", "turning"]
    assert lines[1].split()[1:4] == ["ahead", "built", "+0.17"]
