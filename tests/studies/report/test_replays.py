import base64
import json

from nested_agents.scenarios.box_pushing.pictures import player
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.studies.report.replays import replays
from nested_agents.studies.results import results
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.keeping import spec_of
from nested_agents.studies.trials.trial import trials_of


def read(directory, **options):
    with Store.open(directory) as store:
        return replays(store, results.read(store), trials_of(spec_of(store)), **options)


def test_first_and_last_of_all_finished_trials(kept, tmp_path):
    found = read(kept(tmp_path, done=5))
    assert len(found["episodes"]) == 10
    assert [e["number"] for e in found["episodes"][:2]] == [0, 3]
    assert (len(found["scenes"]), found["remarks"]) == (1, [])
    assert json.loads(json.dumps(found["episodes"])) == found["episodes"]


def test_what_there_is_no_room_for_is_named(kept, tmp_path):
    found = read(kept(tmp_path), max_bytes=1)
    assert len(found["episodes"]) == 2
    assert found["remarks"] == [
        "Left out to keep the page small: frozen (3 seeds), default (2 seeds)."
    ]


def test_damaged_and_foreign_recordings_are_named(kept, tmp_path, monkeypatch):
    directory = kept(tmp_path)
    first, second, *_ = sorted((directory / "recordings").glob("*.npz"))
    first.write_bytes(b"PK")
    second.unlink()
    found = read(directory)
    assert len(found["episodes"]) == 8
    assert len(found["remarks"]) == 1
    assert found["remarks"][0].startswith("Not shown because the recording is missing or damaged: ")
    monkeypatch.delattr(BoxPushing, "animate")
    monkeypatch.setattr(player, "NEEDED", ("hat",))
    assert "the scenario cannot draw it" in "".join(read(directory)["remarks"])


def test_what_the_canvas_cannot_play_is_drawn_by_its_scenario(kept, tmp_path, monkeypatch):
    directory = kept(tmp_path, steps=4)
    monkeypatch.setattr(player, "NEEDED", ("hat",))
    found = read(directory)
    assert [(film["condition"], film["seed"]) for film in found["films"]] == [
        ("default", 0),
        ("frozen", 0),
    ]
    assert all(base64.b64decode(film["data"]).startswith(b"GIF89a") for film in found["films"])
    assert (found["episodes"], found["remarks"]) == ([], [])
    assert read(directory, max_bytes=len(found["films"][0]["data"]))["films"] == found["films"][:1]
