import Box2D
import numpy as np
import pytest

from nested_agents.studies.report import words
from nested_agents.studies.results.statistics import Estimate
from nested_agents.studies.results.summary import Summary


def line(condition, *numbers):
    return Summary(condition, 8, {"success": Estimate(*map(np.asarray, numbers))})


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


def test_nobody_and_one_alone():
    assert words.contest([], None) == ""
    assert words.contest([line("ours", 0.5, 0.4, 0.6)], None) == (
        "success: ours .50 [.40–.60] over 8 seeds."
    )


def test_an_unknown_interval_is_not_taken_for_one():
    table = [line("ours", 0.5, 0.4, 0.6), line("other", 0.1, np.nan, np.nan)]
    assert words.contest(table, "no such title") == (
        "success: highest is ours, .50 [.40–.60]. Interval not known: other .10."
    )


def test_many_are_counted():
    table = [line("ours", 0.9, 0.8, 1.0), *(line(f"c{i}", 0.1, 0.0, 0.2) for i in range(7))]
    said = words.contest(table, "success")
    assert "Intervals wholly below: c0 .10 [0–.20]" in said
    assert said.endswith("c3 .10 [0–.20] and 3 more.")


def test_places_of_the_machine_are_shortened():
    text = "File \"/a/b/c/d.py\", at '/x/y'; 1/2 and a/b/c stay; /srv/data/deep/file.toml: bad"
    assert words.without_places(text) == (
        "File \"…/c/d.py\", at '/x/y'; 1/2 and a/b/c stay; …/deep/file.toml: bad"
    )


def test_versions_name_no_host():
    import platform

    said = dict(words.versions())
    assert said["platform"].split(" on ")[0] == platform.system()
    assert platform.node() not in "".join(said.values())


def test_box2d_may_come_from_any_package(monkeypatch):
    monkeypatch.setattr(Box2D, "__version__", "2.3.10")
    assert dict(words.versions())["Box2D"] == "2.3.10"
