import json

import pytest

from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.studies.errors import SpecError
from nested_agents.studies.store.database import columns, measures_from, tables
from nested_agents.studies.trials.trial import joined

ENERGY = Measure("energy_j", "energy", "J", "joules", "sum", "lower")


def test_scenarios_share_columns_that_mean_the_same():
    titled = Measure("energy_j", "work", "J", "watts", "sum")
    assert joined([(SUCCESS,), (SUCCESS, ENERGY), (titled,)]) == (SUCCESS, ENERGY)
    assert columns((SUCCESS, ENERGY)) == (
        "phase", "episode", "steps", "success", "energy_j", "return",
    )  # fmt: skip


@pytest.mark.parametrize(
    "other",
    [
        Measure("energy_j", "energy", "kJ", "joules", "sum"),
        Measure("energy_j", "energy", "J", "joules", "mean"),
        Measure("energy_j", "energy", "J", "joules", "sum", is_rate=True),
        Measure("Energy_J", "energy", "J", "joules", "sum"),
    ],
)
def test_one_name_for_two_things_is_refused(other):
    with pytest.raises(SpecError, match="is declared as") as caught:
        joined([(ENERGY,), (other,)])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["steps", "Return", "seed", "identity", "scenario.robots"])
def test_names_of_other_columns_are_refused(name):
    with pytest.raises(SpecError, match="a column of results is called so"):
        joined([(SUCCESS, Measure(name, "a measure"))], ["scenario.robots"])


def test_measures_can_be_written_down():
    assert measures_from(json.loads(json.dumps(tables((SUCCESS, ENERGY))))) == (SUCCESS, ENERGY)
    with pytest.raises(TypeError):
        measures_from([{"colour": "red"}])
