import base64
import zlib

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.studies.report import replays as module
from nested_agents.studies.report.replays import body, pack, replays
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.keeping import spec_of
from nested_agents.studies.trials.trial import trials_of


def unpack(packed):
    """The same as replay.js does: poses of box and robots, then the bytes."""
    content = zlib.decompress(base64.b64decode(packed["data"]))
    moments, bodies = packed["steps"] + 1, packed["robots"] + 1
    columns = 3 * bodies
    steps = np.frombuffer(content, "<i2", columns * moments).reshape(columns, moments)
    poses = np.cumsum(steps, axis=1, dtype=np.int16).T.reshape(moments, bodies, 3).astype(float)
    rest = np.frombuffer(content, np.int8, offset=2 * columns * moments).reshape(-1, moments).T
    return poses * [packed["scale"], packed["scale"], np.pi / 32768], rest


def test_an_episode_comes_out_as_it_went_in(recorded):
    recording = recorded()
    poses, rest = unpack(pack(recording, 0.13))
    expected = np.concatenate([recording["box_pose"][:, None], recording["robot_poses"]], axis=1)
    assert np.abs(poses - expected)[..., :2].max() <= 0.51e-4
    turned = (poses - expected)[..., 2]
    assert np.abs((turned + np.pi) % (2 * np.pi) - np.pi).max() < 1e-4
    assert np.abs(rest[:, :8] / 127 * 0.13 - recording["wheel_speeds"]).max() < 0.13 / 250
    assert (rest[:, 8:10] == recording["contact"]).all()
    assert (rest[:, 10:] == recording["failed"]).all()


def test_robots_that_go_far_are_kept_coarser(recorded):
    recording = recorded()
    recording["robot_poses"][-1, 0, :2] = 40.0, -40.0
    packed = pack(recording, 0.13)
    poses, _ = unpack(packed)
    assert packed["scale"] == pytest.approx(40.0 / 32767)
    assert np.allclose(poses[-1, 1, :2], [40.0, -40.0], atol=1e-3)


def test_an_episode_is_small(recorded):
    assert len(pack(recorded(450), 0.13)["data"]) < 15_000


def test_shapes_hold_holes_and_discs(recorded):
    ring = body("four-wheel", str(recorded()["box"]), 2)
    assert [len(points) for points in ring["rings"]] == [4, 4]
    assert (ring["agents"][4], len(ring["wheels"])) == ("robot2.front-left", 4)
    disc = body("e-puck", "circle", 2)
    assert (disc["rings"], disc["disc"] > 0.1) == ([], True)


def read(directory, **options):
    with Store.open(directory) as store:
        return replays(store, trials_of(spec_of(store)), **options)


def test_first_and_last_of_all_finished_trials(kept, tmp_path):
    found = read(kept(tmp_path, done=5))
    assert len(found.episodes) == 10
    assert [e["number"] for e in found.episodes[:2]] == [1, 4]
    assert (len(found.bodies), found.remarks) == (1, [])


def test_what_there_is_no_room_for_is_named(kept, tmp_path):
    found = read(kept(tmp_path), most_bytes=1)
    assert len(found.episodes) == 2
    assert found.remarks == [
        "Left out to keep the page small: frozen: seeds 0 to 2. default: seeds 1, 2."
    ]


def test_damaged_and_foreign_recordings_are_named(kept, tmp_path, monkeypatch):
    directory = kept(tmp_path)
    first, second, *_ = sorted((directory / "recordings").glob("*.npz"))
    first.write_bytes(b"PK")
    second.unlink()
    found = read(directory)
    assert len(found.episodes) == 8
    assert len(found.remarks) == 1
    assert found.remarks[0].startswith("Not shown, as the recording is missing or damaged: ")
    monkeypatch.delattr(BoxPushing, "animate")
    monkeypatch.setattr(module, "NEEDED", ("hat",))
    assert "the scenario cannot draw it" in "".join(read(directory).remarks)


def test_what_the_canvas_cannot_play_is_drawn_by_its_scenario(kept, tmp_path, monkeypatch):
    directory = kept(tmp_path)
    monkeypatch.setattr(module, "NEEDED", ("hat",))
    found = read(directory)
    assert [(film.condition, film.seed) for film in found.films] == [("default", 0), ("frozen", 0)]
    assert all(base64.b64decode(film.data).startswith(b"GIF89a") for film in found.films)
    assert (found.episodes, found.remarks) == ([], [])
    assert read(directory, most_bytes=len(found.films[0].data)).films == found.films[:1]
