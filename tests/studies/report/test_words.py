from importlib import metadata

import pytest

from nested_agents.studies.report import page as words


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        ((1, 1, 0), "Its one trial is done."),
        ((8, 8, 0), "All 8 trials are done."),
        ((8, 5, 1), "Unfinished: 5 of 8 trials are done, 1 failed, 2 left. What follows is"),
        ((8, 7, 1), "With failures: 7 of 8 trials are done, 1 failed. What follows is of"),
        ((8, 0, 0), "Unfinished: 0 of 8 trials are done, 8 left. There is nothing to show yet."),
    ],
)
def test_standing(counts, said):
    assert words.standing(*counts).startswith(said)


def test_places_of_the_machine_are_shortened():
    text = "File \"/a/b/c/d.py\", at '/x/y'; 1/2 and a/b/c stay; /srv/data/deep/file.toml: bad"
    assert words.hide_places(text) == (
        "File \"…/c/d.py\", at '/x/y'; 1/2 and a/b/c stay; …/deep/file.toml: bad"
    )


def test_versions_name_no_host():
    import platform

    said = dict(words.versions())
    assert said["platform"].split(" on ")[0] == platform.system()
    assert platform.node() not in "".join(said.values())


def test_box2d_may_come_from_any_package(monkeypatch):
    def version(package):
        if package == "box2d-py":
            raise metadata.PackageNotFoundError
        return "2.3.10" if package == "box2d" else "1.0"

    monkeypatch.setattr(metadata, "version", version)
    assert dict(words.versions())["Box2D"] == "2.3.10"
