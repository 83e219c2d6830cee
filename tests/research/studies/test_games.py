from pathlib import Path

import numpy as np
import pytest
from made_up_results import NOTHING, Arrays

from nested_agents.studies.catalogue.study import draw_figures
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from research import SPECS, study_of
from research.studies import games as module
from research.studies.games import AFTER_ONE, analyse, check, draw, measure

SPEC = SPECS / "games.toml"
SEEDS = 40


def made_up(chances: dict[tuple[str, str], float]) -> Arrays:
    """Systems that find the optimum of games with these chances, after 1,000 plays by half."""
    rng = np.random.default_rng(0)

    def found(p: float) -> dict:
        return {"success": (rng.random((SEEDS, 1)) < p).astype(int)}

    labels = {key: f"{key[0]}, game={key[1]}" for key in chances}
    last = {labels[key]: found(p) for key, p in chances.items()}
    first = {labels[key]: found(p / 2) for key, p in chances.items()}
    training = {label: {"steps": np.full((SEEDS, 5), 1000)} for label in last}
    columns = {labels[key]: {"name": key[0], "scenario.game": key[1]} for key in chances}
    return Arrays(training, last, {AFTER_ONE: first}, columns=columns)


CHANCES = {("JAL", "climbing"): 0.0, ("nested", "climbing"): 1.0, ("JAL", "penalty:-1"): 0.6}


def test_systems_stand_side_by_side(tmp_path: Path) -> None:
    analysis = analyse(made_up(CHANCES).frames())
    assert [line.seeds for line in analysis.table] == [SEEDS] * 3
    nested = analysis.table[1].estimates["optimal, 5,000 plays"]
    assert nested.value == 1.0
    assert 0.9 < nested.low < 1.0
    notes = "\n".join(analysis.notes)
    assert "A JAL; B nested" in notes
    assert "climbing      0    1\n" in notes
    assert max(map(len, notes.splitlines())) <= 80
    paths = save(draw(analysis), tmp_path)
    assert [path.name for path in paths] == ["games.png", "games.svg"]
    assert draw_figures(module, analyse(NOTHING)) == {}


def test_without_evaluation_it_is_refused() -> None:
    with pytest.raises(SpecError, match=r"evaluation = 0: .*GamesStudy compares"):
        check(Spec.of({"study": study_of("games"), "evaluation": 0}))


def test_the_first_evaluation_leaves_no_trace() -> None:
    changes = ["seeds=[7]", "steps=60", "sweep.scenario.game=['stochastic-climbing']"]
    for trial in trials_of(Spec.load(SPEC, changes))[::4]:
        result = measure(trial)
        alone = module.Session(trial)
        alone.train(5)
        alone.evaluate()
        rows = [row for row in result.rows if row.phase != AFTER_ONE]
        assert tuple(rows) == alone.result().rows
        assert [row.phase for row in result.rows].count(AFTER_ONE) == 1


def test_the_spec_has_the_systems_of_the_table() -> None:
    spec = Spec.load(SPEC)
    assert len(spec.seeds) == 200
    names = {condition.columns["name"] for condition in spec.conditions()}
    assert names >= {
        "independent", "JAL", "maximum, not nested", "optimistic", "FMQ", "passed down only",
        "nested, maximum", "nested, observed", "nested, conditional",
    }  # fmt: skip


def test_nesting_with_the_maximum_climbs_and_observing_does_not() -> None:
    changes = ["seeds=3", "episodes=1", "sweep.scenario.game=['climbing']"]
    trials = trials_of(Spec.load(SPEC, changes))
    found: dict[str, list[bool]] = {}
    for trial in trials:
        system = trial.condition.partition(", game")[0]
        if system in ("nested, maximum", "nested, observed", "JAL"):
            rows = {row.phase: row for row in measure(trial).rows}
            found.setdefault(system, []).append(bool(rows["evaluation"].measures["success"]))
    assert all(found["nested, maximum"])
    assert not any(found["nested, observed"] + found["JAL"])
