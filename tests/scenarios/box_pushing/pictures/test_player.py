import base64
import json
import zlib

import numpy as np

from nested_agents.scenarios.box_pushing.pictures.player import pack, scene_of


def unpack(packed):
    """Return the columns of an episode as arrays, as player.js does."""
    columns = json.loads(zlib.decompress(base64.b64decode(packed["data"])))
    return {name: np.array(column) for name, column in columns.items()}


def test_an_episode_is_unpacked_as_recorded(recorded):
    recording = recorded()
    columns = unpack(pack(recording, scene_of(recording)))
    np.testing.assert_allclose(columns["box"].T, recording["box_pose"], atol=0.51e-4)
    robots = columns["robots"].transpose(2, 0, 1)
    np.testing.assert_allclose(robots, recording["robot_poses"], atol=0.51e-4)
    np.testing.assert_allclose(columns["speeds"].T, recording["wheel_speeds"], atol=0.51e-3)
    assert (recording["contact"] == columns["contact"].T).all()
    assert (recording["failed"] == columns["failed"].T).all()
    assert columns["silent"].size == 0


def test_failing_messages_are_packed(recorded):
    recording = recorded()
    recording["messages_fail"] = np.arange(len(recording["box_pose"]))[:, None] > [2, 4]
    columns = unpack(pack(recording, {}))
    assert (recording["messages_fail"] == columns["silent"].T).all()


def test_an_episode_is_small(recorded):
    assert len(pack(recorded(450), {})["data"]) < 25_000


def test_shapes_hold_holes_and_discs(recorded):
    ring = scene_of(recorded())
    assert [len(points) for points in ring["rings"]] == [4, 4]
    assert (ring["agents"][4], len(ring["wheels"])) == ("robot2.front-left", 4)
    disc = scene_of(recorded() | {"box": np.array("circle")})
    assert len(disc["rings"][0]) == 64
