import base64
import zlib

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.pictures.rendering import pack, scene_of


def unpack(packed):
    """The same as player.js does: poses of box and robots, then the bytes."""
    content = zlib.decompress(base64.b64decode(packed["data"]))
    moments, bodies = packed["steps"] + 1, packed["robots"] + 1
    columns = 3 * bodies
    steps = np.frombuffer(content, "<i2", columns * moments).reshape(columns, moments)
    poses = np.cumsum(steps, axis=1, dtype=np.int16).T.reshape(moments, bodies, 3).astype(float)
    rest = np.frombuffer(content, np.int8, offset=2 * columns * moments).reshape(-1, moments).T
    return poses * [packed["scale"], packed["scale"], np.pi / 32768], rest


def test_an_episode_comes_out_as_it_went_in(recorded):
    recording = recorded()
    poses, rest = unpack(pack(recording, {"speed": 0.13}))
    expected = np.concatenate([recording["box_pose"][:, None], recording["robot_poses"]], axis=1)
    assert np.abs(poses - expected)[..., :2].max() <= 0.51e-4
    turned = (poses - expected)[..., 2]
    assert np.abs((turned + np.pi) % (2 * np.pi) - np.pi).max() < 1e-4
    assert np.abs(rest[:, :8] / 127 * 0.13 - recording["wheel_speeds"]).max() < 0.13 / 250
    assert (rest[:, 8:10] == recording["contact"]).all()
    assert (rest[:, 10:] == recording["failed"]).all()


def test_whose_messages_fail_is_packed_last(recorded):
    recording = recorded()
    recording["messages_fail"] = np.arange(len(recording["box_pose"]))[:, None] > [2, 4]
    packed = pack(recording, {"speed": 0.13})
    assert (packed["talking"], pack(recorded(), {"speed": 0.13})["talking"]) == (2, 0)
    assert (unpack(packed)[1][:, -2:] == recording["messages_fail"]).all()


def test_robots_that_go_far_are_kept_coarser(recorded):
    recording = recorded()
    recording["robot_poses"][-1, 0, :2] = 40.0, -40.0
    packed = pack(recording, {"speed": 0.13})
    poses, _ = unpack(packed)
    assert packed["scale"] == pytest.approx(40.0 / 32767)
    assert np.allclose(poses[-1, 1, :2], [40.0, -40.0], atol=1e-3)


def test_an_episode_is_small(recorded):
    assert len(pack(recorded(450), {"speed": 0.13})["data"]) < 15_000


def test_shapes_hold_holes_and_discs(recorded):
    ring = scene_of(recorded())
    assert [len(points) for points in ring["rings"]] == [4, 4]
    assert (ring["agents"][4], len(ring["wheels"])) == ("robot2.front-left", 4)
    disc = scene_of(recorded() | {"box": np.array("circle")})
    assert (disc["rings"], disc["disc"] > 0.1) == ([], True)
