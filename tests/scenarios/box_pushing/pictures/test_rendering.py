"""Pictures and replays: written whole, of even size, refused by name."""

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.pictures.rendering import (
    SIDES,
    animate,
    picture,
    snapshot,
)
from nested_agents.scenarios.box_pushing.world.settings import BoxSettings, label


@pytest.fixture
def recording() -> dict[str, np.ndarray]:
    steps = 5
    robots = np.zeros((steps, 2, 3))
    robots[:, :, 0] = np.linspace(-0.3, -0.2, steps)[:, None]
    robots[:, :, 1] = [0.05, -0.05]
    return {
        "robot_poses": robots,
        "box_pose": np.zeros((steps, 3)),
        "goal_pose": np.array([1.0, 0.0, 0.0]),
        "wheel_speeds": np.full((steps, 4), 0.1),
        "contact": np.zeros((steps, 2), bool),
        "failed": np.array([[True, False, False, False]] * steps),
        "reward": np.zeros(steps - 1),
        "dt": np.array(0.512),
        "robot": np.array("e-puck"),
        "box": np.array("square"),
    }


def test_a_picture_of_one_moment(recording, tmp_path: Path) -> None:
    snapshot(recording, -1, tmp_path / "end.png")
    picture = imageio.imread(tmp_path / "end.png")
    assert picture.shape[:2] == (SIDES[1], SIDES[0])
    assert len(np.unique(picture.reshape(-1, picture.shape[2]), axis=0)) > 20


def test_robots_whose_messages_fail_have_a_ring(recording) -> None:
    fine = picture(recording, 0)
    recording["messages_fail"] = np.array([[False, False, True, False]] * 5)
    fails = picture(recording, 0)
    assert (fails != fine).any()
    recording["messages_fail"] = np.array([[0, 0, 2, 0]] * 5)  # absent, in the title
    assert (picture(recording, 0) != fails).any()


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_replay_of_all_moments(recording, tmp_path: Path, suffix: str) -> None:
    animate(recording, tmp_path / f"replay{suffix}")
    assert [p.name for p in tmp_path.iterdir()] == [f"replay{suffix}"]
    frames = imageio.imread(tmp_path / f"replay{suffix}", index=...)
    assert len(frames) >= 5
    assert not SIDES[0] % 16
    assert not SIDES[1] % 16


def test_other_formats_are_refused(recording, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"'\.avi' of replay\.avi, allowed \.gif or \.mp4"):
        animate(recording, tmp_path / "replay.avi")


def test_holes_are_holes(recording) -> None:
    ring = ((0, 0), (0.4, 0), (0.4, 0.4), (0, 0.4))
    hole = ((0.05, 0.05), (0.35, 0.05), (0.35, 0.35), (0.05, 0.35))
    areas = []
    for holes in ((), (hole,)):
        recording["box"] = np.array(label(BoxSettings(vertices=ring, holes=holes)))
        pixels = picture(recording, 0).astype(int)
        areas.append(np.count_nonzero(pixels[..., 0] - pixels[..., 2] > 100))
    assert areas[1] / areas[0] == pytest.approx(7 / 16, abs=0.05)


def test_many_robots_can_still_be_seen() -> None:
    rng = np.random.default_rng(0)
    recording = {
        "robot_poses": rng.uniform(-5, 5, (1, 64, 3)),
        "box_pose": np.zeros((1, 3)),
        "goal_pose": np.array([1.0, 0.0, 0.0]),
        "wheel_speeds": np.zeros((1, 128)),
        "contact": np.ones((1, 64), bool),
        "dt": np.array(0.512),
        "robot": np.array("e-puck"),
        "box": np.array("square"),
    }
    pixels = picture(recording, 0).astype(int)
    blue = np.count_nonzero(pixels[..., 2] - pixels[..., 0] > 80)
    assert blue > 16 * 8  # of 64 robots 16 are blue
