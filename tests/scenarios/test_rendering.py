"""Pictures and replays: written whole, of even size, refused by name."""

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from nested_agents.scenarios.rendering import SIDES, animate, snapshot


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
