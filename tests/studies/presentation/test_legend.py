import pytest

from nested_agents.studies.presentation.legend import meanings


@pytest.mark.parametrize(
    ("title", "begins"),
    [
        ("success, eight", "success in the evaluation of this name"),
        ("evaluation success, difference", "difference from the first condition"),
        ("final distance [m]", "distance from the goal"),
    ],
)
def test_a_column_is_explained(title, begins):
    assert meanings([title])[title].startswith(begins)


def test_what_only_a_scenario_knows_is_left_out():
    assert meanings(["humidity"]) == {}
