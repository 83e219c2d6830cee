"""How wrong predictors are: ``python -m research.prediction_errors``.

A scripted controller pushes boxes of all shapes, with and without failures. After every decision
period in contact, the poses that each predictor predicted are held against those that came.
"""

from collections.abc import Mapping
from math import hypot, pi
from typing import Any

import numpy as np

from nested_agents import BoxPushing, BoxPushingSettings
from nested_agents.boxes import BOXES, BoxPrediction, push_model

from .scripted.controller import ScriptedController

PREDICTORS = ("push", "rigid", "static")
SEEDS, STEPS = range(4), 40
FAILURES: dict[str, dict[str, Any] | None] = {
    "none": None,
    "seized": {"kind": "seized"},
    "free": {"kind": "free"},
    "weak 0.3": {"kind": "weak", "gain": 0.3},
    "reversed": {"kind": "reversed"},
    "stuck at half": {"kind": "stuck", "speed": 0.5},
    "delayed by 8": {"kind": "delayed", "periods": 8},
    "noisy 0.3": {"kind": "noisy", "deviation": 0.3},
}


def errors(**scenario: Any) -> tuple[int, list[float]]:
    """Return the number of contact pushes and means over them [mm, mrad].

    How far the box went; then, predictor by predictor, how far its predicted place was off, and
    how much its predicted orientation; and last the yaw error of the robots, of push alone.
    """
    world = BoxPushing(BoxPushingSettings.model_validate({"start": "easy"} | scenario))
    robots = list(world.world.robots)
    controller = ScriptedController(world)
    models = [push_model(name, robots, world.box) for name in PREDICTORS]
    rows = []
    for seed in SEEDS:
        world.reset(seed)
        for _ in range(STEPS):
            before = world.measure()
            joint = controller.act(before)
            now = world.predict()
            views = [
                BoxPrediction(now.situation, model, now.settings).poses(joint[None])
                for model in models
            ]
            transition = world.step(joint)
            after: Mapping[str, Any] = transition.info
            if after["contact_time"].any():
                row = [1000 * moved(before["box_pose"], after["box_pose"])]
                row += [1000 * moved(view.boxes[:, 0], after["box_pose"]) for view in views]
                row += [1000 * turned(view.boxes[2, 0], after["box_pose"][2]) for view in views]
                yaw = turned(views[0].robots[:, 2, 0], after["robot_poses"][:, 2])
                rows.append([*row, 1000 * float(np.mean(yaw))])
            if transition.terminated or transition.truncated:
                break
    return len(rows), np.mean(rows, axis=0).tolist()


def moved(one: Any, other: Any) -> float:
    """Return the distance of two poses [m]."""
    return hypot(*(one - other)[:2])


def turned(one: Any, other: Any) -> Any:
    """Return by how much headings differ [rad]."""
    return abs((one - other + pi) % (2 * pi) - pi)


def table(title: str, cases: Mapping[str, Mapping[str, Any]]) -> None:
    """Print a table in Markdown."""
    place = " | ".join(f"{name} [mm]" for name in PREDICTORS)
    turn = " | ".join(f"{name} [mrad]" for name in PREDICTORS)
    print(f"| {title} | pushes | box moved [mm] | {place} | {turn} | robot yaw, push [mrad] |")
    print("|---" * (4 + 2 * len(PREDICTORS)) + "|")
    for name, scenario in cases.items():
        count, means = errors(**scenario)
        print(f"| {name} | {count} | " + " | ".join(f"{mean:.1f}" for mean in means) + " |")
    print()


def main() -> None:
    """Print the tables."""
    table("box", {name: {"box": name} for name in BOXES})
    for robot, wheel in (("e-puck", "left"), ("four-wheel", "front-left")):
        cases = {
            name: {
                "robot": robot,
                "failures": [{**failure, "wheels": f"robot1.{wheel}"}] if failure else [],
            }
            for name, failure in FAILURES.items()
        }
        table(f"failure of one wheel, {robot}", cases)


if __name__ == "__main__":
    main()
