"""What calibration finds out: ``python -m research.calibration``.

Teams of the default learner begin with constants of the push that are wrong by a factor of 2 each,
and calibrate them. Told are the constants over the right ones after so many decisions that pushed,
and how far the box was from where it was predicted to be: by what was believed at first, by the
constants calibrated until then, and by the simulator's own.
"""

import sys
from typing import Any

import numpy as np

from nested_agents import (
    BatchTDSettings,
    BoxPushing,
    BoxPushingSettings,
    FuzzyAgents,
    Team,
    policy_seed,
)
from nested_agents import build_hierarchy as build
from nested_agents import parse_topology as parse
from nested_agents.parts import (
    CalibrationSettings,
    EmbodiedPrediction,
    Experience,
    SelfModelSettings,
)
from nested_agents.study import world_seed

BELIEFS = {
    "right": {"stiffness": 1.0, "load": 1.0, "contact_friction": 1.0},
    "too soft": {"stiffness": 0.5, "load": 2.0, "contact_friction": 0.5},
    "too stiff": {"stiffness": 2.0, "load": 0.5, "contact_friction": 2.0},
}
SEED, STEPS = 10000, 200
AFTER = (20, 40, 80, 160)


def calibrated(robot: str, believed: str, episodes: int) -> tuple[Any, Any]:
    """Return the constants over the right ones after every push, and errors of the box [mm].

    Errors are those of what was believed, of what was calibrated, and of the right constants.
    """
    belief = BELIEFS[believed]
    scenario = BoxPushing(BoxPushingSettings.model_validate({"robot": robot, "belief": belief}))
    settings = BatchTDSettings(
        calibration=CalibrationSettings(enabled=True),
        self_model=SelfModelSettings(enabled=robot != "e-puck"),
    )
    hierarchy = build(parse("chain"), scenario.agents, scenario.groups)
    team = Team(settings, scenario, hierarchy, policy_seed(SEED))
    model = team.only(FuzzyAgents).model
    assert model.calibration is not None
    load_per_stiffness = belief["load"] / belief["stiffness"]
    right = -np.log([load_per_stiffness, load_per_stiffness, belief["contact_friction"]])
    beliefs, errors = [], []
    for episode in range(episodes):
        states = scenario.reset(world_seed(SEED, episode), episode)
        team.reset(0, 0, learn=True)
        for step in range(STEPS):
            seen = team.observe(scenario, states)
            prediction = model.predict(seen)
            assert isinstance(prediction, EmbodiedPrediction)
            decision = team.act(seen)
            tried = np.array([np.zeros(3), model.calibration.constants, right])
            predicted = prediction.outcomes(decision.joint_action, tried)
            transition = scenario.step(decision.joint_action)
            last = transition.terminated or transition.truncated or step == STEPS - 1
            team.learn(Experience(seen, decision, transition, last))
            box, *bodies = transition.measured_twists()
            if len(bodies) == len(scenario.groups) and np.hypot(*box[:2]) > 0.002:
                off = np.hypot(*(predicted[:, 0] - box)[:, :2].T)
                errors.append(1000 * off * scenario.settings.action_repeat * 0.064)
                beliefs.append(np.exp(model.calibration.constants - right))
            states = transition.states
            if last:
                break
    return np.array(beliefs), np.array(errors)


def main() -> None:
    """Print the table."""
    print("| robot, believed | " + " | ".join(f"after {k}" for k in AFTER), end=" ")
    print("| after all | pushes | believed [mm] | calibrated [mm] | right [mm] |")
    print("|---" * (len(AFTER) + 6) + "|")
    for robot, episodes in (("e-puck", 6), ("four-wheel", 4)):
        for believed in BELIEFS:
            beliefs, errors = calibrated(robot, believed, episodes)
            shown = [beliefs[min(k, len(beliefs)) - 1] for k in (*AFTER, len(beliefs))]
            cells = [", ".join(f"{factor:.2f}" for factor in factors) for factors in shown]
            means = " | ".join(f"{mean:.1f}" for mean in errors.mean(axis=0))
            print(f"| {robot}, {believed} | {' | '.join(cells)} | {len(beliefs)} | {means} |")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
