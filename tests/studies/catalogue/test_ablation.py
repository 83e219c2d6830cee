from dataclasses import replace
from pathlib import Path

import pytest
from made_up_results import NOTHING, ablation, hierarchies

from nested_agents.studies.catalogue import ablation as module
from nested_agents.studies.catalogue.ablation import analyse, draw
from nested_agents.studies.catalogue.study import analyse_as, load_study
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.spec.spec import Spec

CHANCES = {"default": 0.8, "no replay": 0.2, "no termination radius": 0.8, "more of it": 1.0}


def test_what_matters_is_named_and_what_does_not_is_not() -> None:
    analysis = analyse(ablation(CHANCES).frames())
    text = "\n".join(analysis.notes)
    assert "worse: no replay" in text
    assert "better: more of it" in text
    assert text.count("no significant difference: no termination radius") == 2
    assert "adjusted over 6 comparisons" in text
    assert [line.condition for line in analysis.table] == list(CHANCES)
    by_name = {line.condition: line.estimates for line in analysis.table}
    assert by_name["default"]["evaluation success, difference"].value == 0.0
    assert by_name["no replay"]["evaluation success, difference"].high < -0.4


def test_a_condition_without_two_seeds_in_common_has_no_difference() -> None:
    results = ablation(CHANCES).frames()
    is_kept = (results.trials["condition"] != "no replay") | (results.trials["seed"] == 0)
    first = (results.episodes["condition"] != "no replay") | (results.episodes["seed"] == 0)
    part = replace(results, trials=results.trials[is_kept], episodes=results.episodes[first])
    by_name = {line.condition: line.estimates for line in analyse(part).table}
    titles = {title for title in by_name["more of it"] if title.endswith("difference")}
    assert len(titles) == 2
    assert titles <= by_name["default"].keys()
    assert not titles & by_name["no replay"].keys()


@pytest.mark.parametrize("name", ["ablation", "hierarchies"])
def test_runs_without_a_partner_are_counted(name: str) -> None:
    chances = {("chain", "team", 2): 0.9, ("star", "team", 2): 0.5}
    made = ablation(CHANCES) if name == "ablation" else hierarchies(chances)
    own = list(made.training)[1]
    made.seeds[own] = tuple(range(5, 25))
    text = " ".join(" ".join(load_study(name).analyse(made.frames()).notes).split())
    reference, label = ("default", own) if name == "ablation" else ("chain", "2 robots, team, star")
    assert text.count("Left out of differences") == 1
    assert f"no partner: 10 of 40 runs of {reference} and {label}." in text


@pytest.mark.parametrize("name", ["ablation", "learning-curve"])
def test_conditions_without_training_are_named(name: str) -> None:
    made = ablation({"default": 0.8, "slow": 0.4, "random": 0.1})
    del made.training["random"]
    (line,) = [n for n in analyse_as(name, made.frames()).notes if "Not in the table" in n]
    assert "training: random" in line


def test_the_figure_is_drawn_or_left_out(tmp_path: Path) -> None:
    paths = save(draw(analyse(ablation(CHANCES).frames())), tmp_path)
    assert [path.name for path in paths] == ["ablation.png", "ablation.svg"]
    assert draw(analyse(NOTHING)) == {}


def test_the_spec_compares_one_change_at_a_time_over_twenty_seeds() -> None:
    spec = Spec.load(Path(module.__file__).parent / "ablation.toml")
    default, *others = spec.conditions()
    assert default.label == "default"
    assert len(spec.seeds) >= 20
    assert default.settings == Spec.of({"preset": "own-value"}).conditions()[0].settings
    for other in others[:-1]:
        changed = [
            name
            for name in ("scenario", "topology", "learner")
            if getattr(other.settings, name) != getattr(default.settings, name)
        ]
        assert len(changed) == 1, other.label
    assert others[-1].settings == Spec.of({"preset": "paper"}).conditions()[0].settings
