from pathlib import Path

import numpy as np
import pytest
from made_up_results import NOTHING, SEEDS, Arrays
from nested_agents_signals.scenario import MEASURES
from nested_agents_signals.theory import cascade, majority

from nested_agents.studies.catalogue.study import draw_figures
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from research import SPECS, study_of
from research.studies import signals as module
from research.studies.signals import analyse, check, draw, measure

PATHS = sorted(SPECS.glob("signals*.toml"))


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_every_spec_can_be_run(path: Path) -> None:
    check(Spec.load(path))


def test_another_world_is_refused() -> None:
    with pytest.raises(SpecError, match="'box-pushing': signals needs 'signals'"):
        check(Spec(study=study_of("signals"), evaluation=1))


def test_a_trial_has_its_theory() -> None:
    spec = Spec.load(SPECS / "signals.toml")
    spec = spec.model_copy(update={"episodes": 1, "steps": 2, "evaluation": 1, "seeds": 1})
    trials = {trial.condition: trial for trial in trials_of(spec)}
    told = measure(trials["Bayesian, told, players=8"]).numbers
    assert told["messages"] == 28.0
    assert told["theory.last"] == cascade(8, 0.7).right[-1]
    silent = measure(trials["fitted-q, not told, players=8"]).numbers
    assert silent["theory.vote"] == majority(8, 0.7)
    assert (silent["theory.right"], silent["messages"]) == (pytest.approx(0.7), 0.0)


def made_up() -> Arrays:
    """Return teams of 2 and 4 who are right as theory says, but for the vote of 4."""
    rng = np.random.default_rng(0)
    base = Arrays(measures=MEASURES)
    for n in (4, 2):
        theory = cascade(n, 0.7)
        said = {"right": theory.right.mean(), "last": theory.right[-1], "vote": theory.vote}
        means = said | {"vote": theory.vote - 0.2 * (n == 4), "success": 1.0}
        shape = SEEDS, 5
        condition = f"told, players={n}"
        base.evaluation[condition] = {k: v + rng.normal(0, 0.01, shape) for k, v in means.items()}
        base.columns[condition] = {"name": "told", "scenario.players": n}
        numbers = {f"theory.{name}": value for name, value in said.items()}
        numbers |= {"robots": float(n), "messages": n * (n - 1) / 2}
        base.numbers[condition] = {k: np.full(SEEDS, v) for k, v in numbers.items()}
    return base


def test_estimates_stand_beside_theory(tmp_path: Path) -> None:
    analysis = analyse(made_up().frames())
    assert [line.condition for line in analysis.table] == ["2 players, told", "4 players, told"]
    four = analysis.table[1].estimates
    assert float(four["last right, theory"].value) == cascade(4, 0.7).right[-1]
    assert float(four["vote right"].value) == pytest.approx(cascade(4, 0.7).vote - 0.2, abs=0.01)
    assert analysis.notes[1] == "told: theory within the interval in 5 of 6"
    paths = save(draw(analysis), tmp_path)
    assert [path.name for path in paths] == ["signals.png", "signals.svg"]


def test_nothing_is_drawn_of_nothing() -> None:
    assert draw_figures(module, analyse(NOTHING)) == {}
