"""Numbers of trials have units wherever they are shown."""

from importlib import import_module
from pathlib import Path

import pytest

import nested_agents as na
from nested_agents.studies.results.results import NUMBERS
from nested_agents.studies.spec.studies import STUDIES


@pytest.mark.parametrize("study", list(STUDIES.built_in))
def test_every_number_of_a_study_is_told(study: str) -> None:
    module = import_module(f"nested_agents.studies.catalogue.{study.replace('-', '_')}")
    assert set(getattr(module, "NUMBERS", ())) <= set(NUMBERS)


def test_frames_tell_the_units_of_numbers(tmp_path: Path) -> None:
    pytest.importorskip("pandas", reason="extra [pandas]")
    spec = {
        "study": "scaling", "seeds": 2, "episodes": 1, "steps": 3, "evaluation": 1,
        "preset": "own-value", "scenario": {"kind": "line-up"}, "sweep": {"scenario.carts": [2, 3]},
    }  # fmt: skip
    study = na.run(spec, tmp_path / "out", jobs=1, progress=False)
    columns = study.trials.attrs["columns"]
    assert columns["decision_median"]["unit"] == "s"
    assert columns["scenario.carts"]["meaning"] == "a swept key"
