from pathlib import Path

import pytest
from made_up_results import NOTHING, SEEDS, Arrays, games

from nested_agents.studies.catalogue.study import draw_figures
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from research import SPECS, study_of
from research.studies import fit as module
from research.studies.fit import analyse, check, draw, measure

EDGES = {"own edges": 0.95, "wrong edges": 0.3, "none": 0.3}


def made_up(edges: dict[str, float] = EDGES) -> Arrays:
    base = games(edges)
    for condition, columns in base.columns.items():
        columns["scenario.shape"] = columns.pop("scenario.game")
        columns["scenario.players"] = 8
        base.numbers[condition] = {"robots": [8.0] * SEEDS, "messages": [7.0] * SEEDS}
    return base


def test_edges_are_compared_with_none_in_their_game() -> None:
    analysis = analyse(made_up().frames())
    assert [line.condition for line in analysis.table] == [
        f"8 players, climbing, {name}" for name in EDGES
    ]
    assert float(analysis.table[0].estimates["messages"].value) == 7.0
    ((own, wrong),) = analysis.differences.values()
    assert (own.condition, wrong.condition) == ("own edges", "wrong edges")
    assert own.estimate.low > 0.4
    assert own.p < 0.05 < wrong.p


def test_the_figure_is_drawn_or_left_out(tmp_path: Path) -> None:
    paths = save(draw(analyse(made_up().frames())), tmp_path)
    assert [path.name for path in paths] == ["fit.png", "fit.svg"]
    assert draw_figures(module, analyse(NOTHING)) == {}


PATHS = sorted(SPECS.glob("fit*.toml"))


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_every_spec_can_be_run(path: Path) -> None:
    check(Spec.load(path))


def test_a_study_without_a_condition_of_no_edges_is_refused() -> None:
    with pytest.raises(SpecError, match='name = "none", there is none'):
        check(Spec(study=study_of("fit"), evaluation=1))


def test_a_trial_counts_agents_and_messages() -> None:
    spec = Spec.load(SPECS / "fit.toml").model_copy(update={"episodes": 2, "seeds": 1})
    trials = {trial.condition: trial for trial in trials_of(spec)}
    result = measure(trials["with fill-in, shape=ring"])
    assert result.numbers == {"robots": 8.0, "messages": 13.0}
    assert [row.phase for row in result.rows] == ["training", "training", "evaluation"]
