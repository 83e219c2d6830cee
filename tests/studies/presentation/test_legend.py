import pytest

from nested_agents.studies.presentation.legend import meanings


@pytest.mark.parametrize(
    ("title", "begins"),
    [
        ("success, eight", "the same in the evaluation of this name"),
        ("evaluation success, difference", "from the first condition"),
        ("final distance [m]", "to the goal"),
    ],
)
def test_a_column_is_explained(title, begins):
    assert meanings([title])[title].startswith(begins)


def test_what_only_a_scenario_knows_is_left_out():
    assert meanings(["humidity"]) == {}
