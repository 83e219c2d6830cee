"""The peers study: evaluations on the way, comparison and figure."""

from pathlib import Path

import numpy as np
import pytest
from made_up_results import NOTHING, Arrays

from nested_agents.studies.catalogue.study import draw_figures, load_study
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
from research import SPECS, study_of
from research.studies import peers as module
from research.studies.peers import analyse, check, draw, measure, stops

PATHS = sorted(path for path in SPECS.glob("*.toml") if "peers.py:PeersStudy" in path.read_text())
SEEDS = 10


def made_up() -> Arrays:
    """Ours succeeds from the second evaluation on, and PPO half as often at the end."""
    rng = np.random.default_rng(0)

    def found(p: float) -> dict[str, np.ndarray]:
        return {"success": (rng.random((SEEDS, 20)) < p).astype(int)}

    chances = {"fuzzy TD": (0.0, 1.0, 1.0), "PPO": (0.0, 0.1, 0.5)}
    phases = {
        f"after {count}": {c: found(p[i]) for c, p in chances.items()}
        for i, count in enumerate((2, 10))
    }
    last = {c: found(p[2]) for c, p in chances.items()}
    training = {c: {"steps": np.full((SEEDS, 20), 50)} for c in chances}
    seeds = dict.fromkeys(chances, tuple(range(SEEDS)))
    usage = {
        c: {f"cpu.{n}": np.full(SEEDS, rate * n) for n in (2, 10, 20)}
        for c, rate in {"fuzzy TD": 0.5, "PPO": 2.0}.items()
    }
    return Arrays(training, last, phases, seeds=seeds, usage=usage)


def test_success_against_experience(tmp_path: Path) -> None:
    analysis = analyse(made_up().frames())
    ours, _ = analysis.cases
    assert ours.decisions.tolist() == [100, 500, 1000]
    assert ours.values.value.tolist() == [0, 1, 1]
    assert list(analysis.table[0].estimates) == [
        "success, 2", "success, 10", "evaluation success", "decisions", "CPU [s]"
    ]  # fmt: skip
    ((difference,),) = analysis.differences.values()
    assert difference.condition == "PPO"
    assert float(difference.estimate.value) == pytest.approx(-0.5, abs=0.1)
    assert max(len(line) for note in analysis.notes for line in note.splitlines()) <= 80
    paths = save(draw(analysis), tmp_path)
    assert [path.name for path in paths] == ["peers.png", "peers.svg"]
    assert draw_figures(module, analyse(NOTHING)) == {}


def test_evaluations_on_the_way_leave_no_trace() -> None:
    table = {
        "study": study_of("peers"), "seeds": [7], "episodes": 5, "steps": 20, "evaluation": 2,
        "scenario": {"kind": "line-up"},
    }  # fmt: skip
    (trial,) = trials_of(Spec.of(table))
    result = measure(trial)
    on_the_way = [row for row in result.rows if row.phase.startswith("after ")]
    assert [row.phase for row in on_the_way[::2]] == [f"after {n}" for n in stops(5)]
    assert tuple(row for row in result.rows if row not in on_the_way) == run_trial(trial).rows
    assert list(result.usage) == [f"cpu.{n}" for n in (*stops(5), 5)]


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(SpecError, match=r"evaluation = 0: .*PeersStudy compares"):
        check(Spec.of({"study": study_of("peers"), "evaluation": 0}))


@pytest.mark.parametrize("study", ["wheel-failure", study_of("related")])
def test_studies_of_rule_bases_refuse_peers_before_they_begin(study: str, tmp_path: Path) -> None:
    path = tmp_path / "spec.toml"
    path.write_text(f'study = "{study}"\n[learner]\nkind = "ppo"\n')
    with pytest.raises(SpecError, match=rf"'ppo': {study} needs agents with rule bases") as raised:
        load_study(study).check(Spec.load(path))
    assert "allowed batch-td, " in str(raised.value)
    assert "ippo" not in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_specs(path: Path) -> None:
    assert all(c.settings.learner.kind for c in Spec.load(path).conditions())
