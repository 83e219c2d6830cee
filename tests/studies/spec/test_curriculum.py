import pytest

from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.conditions import StageSettings
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.trials.keeping import difference, notes_of

TWO_STAGES = """
[scenario]
robots = 8

[[curriculum]]
name = "two"
episodes = 10
scenario.robots = 2

[[curriculum]]
name = "four, circle"
episodes = 6
scenario = { robots = 4, box = "circle" }
"""


def stages_of(condition):
    return [(s.name, s.episodes, s.scenario.robots, s.scenario.box) for s in condition.curriculum]


def test_stages_are_laid_over_the_scenario_of_every_condition():
    spec = Spec.parse(TWO_STAGES + "[sweep]\nscenario.start = ['easy', 'hard']")
    for condition, start in zip(spec.conditions(), ("easy", "hard"), strict=True):
        assert stages_of(condition) == [
            ("two", 10, 2, "square"), ("four, circle", 6, 4, "circle"),
        ]  # fmt: skip
        assert {s.scenario.start for s in condition.curriculum} == {start}
        assert condition.settings.scenario.robots == 8


def test_an_override_may_have_stages_of_its_own_or_none():
    spec = Spec.parse(
        TWO_STAGES + "[[overrides]]\nname = 'as above'\n[[overrides]]\nname = 'none'\n"
        "curriculum = []\n[[overrides]]\nname = 'more of the same'\n"
        "curriculum = [{name = 'eight', episodes = 16}]"
    )
    one, none, same = spec.conditions()
    assert len(one.curriculum) == 2
    assert none.curriculum == ()
    assert stages_of(same) == [("eight", 16, 8, "square")]
    again = Spec.parse(dumps(spec.table()))
    assert again == spec
    assert again.conditions() == spec.conditions()


BAD = {
    "curriculum = 3": ["curriculum = 3", "list"],
    "curriculum = [{episodes = 3}]": ["curriculum[0].name", "missing"],
    "curriculum = [{name = 'a'}]": ["curriculum[0].episodes", "missing"],
    "curriculum = [{name = 'a', episodes = 0}]": ["curriculum[0].episodes = 0", "at least 1"],
    "curriculum = [{name = '', episodes = 1}]": ["curriculum[0].name", "can be printed"],
    "curriculum = [{name = 'a', episods = 1}]": ["curriculum[0].episods", "did you mean"],
    "curriculum = [{name = 'a', episodes = 1}, {name = 'a', episodes = 2}]": ["distinct names"],
    "curriculum = [{name = 'a', episodes = 1, scenario = {robts = 2}}]": [
        "scenario.robts = 2", "did you mean 'robots'", "(stage 'a')",
    ],
    "curriculum = [{name = 'a', episodes = 1, scenario = 3}]": ["curriculum[0].scenario = 3"],
    "overrides = [{name = 'b', curriculum = [{name = 'a'}]}]": ["overrides[0].curriculum[0]"],
    "overrides = [{name = 'b', curriculum = []}, {name = 'c'}]": ["'b' and 'c' are the same"],
}  # fmt: skip


@pytest.mark.parametrize("text", BAD)
def test_what_is_wrong_is_said_in_one_line(text):
    with pytest.raises(SpecError) as caught:
        Spec.parse(text)
    assert "\n" not in str(caught.value)
    for part in BAD[text]:
        assert part in str(caught.value)


def test_another_curriculum_is_another_study():
    there = notes_of(Spec.parse(TWO_STAGES))
    assert difference(there, notes_of(Spec.parse(TWO_STAGES))) is None
    other = Spec.parse(TWO_STAGES.replace("episodes = 6", "episodes = 7"))
    assert difference(there, notes_of(other)).startswith("curriculum = [{")
    without = notes_of(Spec.parse("scenario.robots = 8"))
    assert "curriculum = absent there" in difference(without, there)


def test_a_stage_may_hold_settings_made_by_python():
    from nested_agents.scenarios.line_up import LineUpSettings

    stage = {"name": "carts", "episodes": 1, "scenario": LineUpSettings(carts=3)}
    (condition,) = Spec.of({"curriculum": [stage]}).conditions()
    assert condition.curriculum[0].scenario == LineUpSettings(carts=3)
    assert StageSettings(name="a", episodes=1).scenario == {}
