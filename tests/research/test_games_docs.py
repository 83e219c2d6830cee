"""The pages of games and coordination graphs say what is so."""

import re
from pathlib import Path

import pytest

from nested_agents.studies.errors import SpecError
from nested_agents.studies.results import published
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from research import RESULTS
from research.studies.games import analyse

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
GAMES = (DOCS / "environments" / "matrix_games.md").read_text(encoding="utf-8")
FOUND = (ROOT / "research" / "notebooks" / "matrix_games.md").read_text(encoding="utf-8")
GRAPHS = (DOCS / "coordination_graphs.md").read_text(encoding="utf-8")


def games():
    return analyse(published.load(RESULTS / "games.json").results)


@pytest.mark.parametrize("text", [GAMES, GRAPHS], ids=["games", "coordination graphs"])
def test_specs(text: str) -> None:
    for spec in re.findall(r"```toml\n(.*?)```", text, re.DOTALL):
        check_conditions(Spec.parse(spec))


def test_the_grids_are_those_of_the_published_rows() -> None:
    assert "\n".join(games().notes).strip("\n") in FOUND


def test_nesting_with_the_maximum_meets_the_target() -> None:
    nested = [case for case in games().cases if case.system == "nested, maximum"]
    assert len(nested) == 12
    assert all(e.value >= 0.99 and e.low >= 0.97 for case in nested for e in case.values.values())
    observed = [case for case in games().cases if case.system in ("JAL", "nested, observed")]
    climbing = [case for case in observed if case.setting[0] == "climbing"]
    assert all(e.value == 0.0 for case in climbing for e in case.values.values())


def test_a_wide_graph_is_refused_in_the_words_of_the_page() -> None:
    (said,) = re.findall(r"```text\n(learner\.decision\.evaluator.*?)\n```", GRAPHS, re.DOTALL)
    (spec,) = re.findall(r"```toml\n(.*?)```", GRAPHS, re.DOTALL)
    wide = re.sub(r'kind = "coordination-graph"\nshape = .*', 'kind = "simultaneous"', spec)
    with pytest.raises(SpecError) as refused:
        check_conditions(Spec.parse(wide, ["scenario.carts=16"]))
    assert str(refused.value) == " ".join(said.split())
