"""Studies of function agents and mixed teams, and their failures."""

from pathlib import Path

import numpy as np
import pytest

from nested_agents.core.agents.loop import control_loop
from nested_agents.studies.api.running import run
from nested_agents.studies.api.study import StudyResults
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import SPEC_FILE
from nested_agents.studies.trials.arrangement import Arrangement, arrange, check_conditions
from nested_agents.studies.trials.trial import trials_of

PROGRAM = """
def fails(observation, agent, rng):
    return "jump" if agent == "cart2" and rng.random() < 0.5 else 0
"""


@pytest.fixture
def spec(tmp_path: Path) -> dict:
    (tmp_path / "f.py").write_text(PROGRAM)
    return {
        "seeds": 10, "episodes": 1, "steps": 10, "evaluation": 1,
        "scenario": {"kind": "line-up", "carts": 5},
    }  # fmt: skip


def rows(study: StudyResults):
    return study.episodes.drop(columns="condition")


def test_a_trial_whose_function_fails_names_the_agent_and_others_go_on(spec, tmp_path) -> None:
    spec["learner"] = {"kind": str(tmp_path / "f.py:fails")}
    spec |= {"steps": 1, "seeds": 8, "evaluation": 0}
    with pytest.warns(UserWarning, match="failed: study.failed says why"):
        study = run(spec, tmp_path / "out", jobs=2, progress=False)
    assert 0 < len(study.failed) < 8
    for *_, error in study.failed:
        assert "agent 'cart2': " in error.splitlines()[-1]
        assert "returns the action 'jump', allowed: increase" in error.splitlines()[-1]


def test_a_mixed_team_of_one_kind_has_the_rows_of_the_plain_one(tmp_path: Path) -> None:
    learner = {"kind": "td-lambda", "step_size": 0.1}
    spec = {
        "preset": "own-value", "seeds": 2, "episodes": 3, "steps": 20, "evaluation": 2,
        "scenario": {"kind": "line-up", "carts": 3}, "keep_teams": True,
    }  # fmt: skip
    mixed = {"kind": "mixed", "parts": [{"agents": "*", "learner": learner}]}
    plain = run({**spec, "learner": learner}, tmp_path / "plain", jobs=1, progress=False)
    study = run({**spec, "learner": mixed}, tmp_path / "mixed", jobs=1, progress=False)
    assert rows(study).equals(rows(plain))


LINE_UP = {
    "preset": "own-value", "seeds": 1, "episodes": 3, "steps": 20, "evaluation": 2,
    "scenario": {"kind": "line-up", "carts": 3},
}  # fmt: skip
LEARNER = {"kind": "batch-td", "weights": "role"}


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    spec = {**LINE_UP, "learner": LEARNER, "keep_teams": True, "episodes": 10}
    study = run(spec, tmp_path / "kept", jobs=1, progress=False)
    path = tmp_path / "trained.npz"
    study.team(study.trials["condition"].iloc[0], 0)[1].save(path)
    return path


def mixed(*parts: dict) -> dict:
    return {**LINE_UP, "learner": {"kind": "mixed", "parts": list(parts)}}


def test_a_part_begins_with_the_weights_of_a_kept_team(kept: Path, tmp_path: Path) -> None:
    old = {"agents": "cart1", "learner": {**LEARNER, "kind": "frozen"}, "team": str(kept)}
    new = {"agents": "*", "learner": LEARNER}
    spec = Spec.of(mixed(old, new))
    there = arrange(spec.conditions()[0].settings, 0)
    with np.load(kept) as arrays:
        theta = arrays["learner.theta"]
    assert np.any(theta)
    begun, learning = there.team.parts
    assert begun.learner.theta.tolist() == theta.tolist()
    assert not learning.learner.theta.any()
    list(control_loop(there.scenario, there.team, episodes=2, steps=10, seed=0))
    assert begun.learner.theta.tolist() == theta.tolist()
    assert learning.learner.theta.any()
    study = run(mixed(old, new), tmp_path / "out", jobs=1, progress=False)
    kept.unlink()  # the study has its own copy
    again = run(tmp_path / "out" / SPEC_FILE, tmp_path / "again", jobs=1, progress=False)
    assert rows(again).equals(rows(study))


def of_two_robots(*parts: dict) -> Arrangement:
    box = {"kind": "box-pushing", "robots": 2}
    learner = {"kind": "mixed", "parts": list(parts)}
    return arrange(
        Spec.of({**LINE_UP, "scenario": box, "learner": learner}).conditions()[0].settings, 0
    )


@pytest.mark.parametrize("kind", ["batch-td", "fitted-q", "td-lambda"])
def test_weights_and_experience_of_a_kept_team_are_found_by_role(kind: str, tmp_path: Path) -> None:
    own = {"kind": kind, "weights": "role"}
    there = of_two_robots({"agents": "*", "learner": own})
    list(control_loop(there.scenario, there.team, episodes=2, steps=20, seed=0))
    path = str(tmp_path / "trained.npz")
    there.team.save(path)
    (trained,) = there.team.parts
    first = {"agents": "robot1.left", "learner": {"kind": "frozen"}}
    begun = of_two_robots(first, {"agents": "*", "learner": own, "team": path}).team.parts[1]
    rows = {part: dict(zip(part.owners, part.rows, strict=True)) for part in (trained, begun)}
    assert rows[trained] != rows[begun], "right wheels come first"
    for role, row in rows[trained].items():
        former, mine = trained.learner, begun.learner
        assert former.theta[row].any()
        assert (mine.theta[rows[begun][role]] == former.theta[row]).all()
        if kind != "td-lambda":
            assert (mine.states_of(rows[begun][role]) == former.states_of(row)).all()


def test_a_file_that_does_not_name_roles_is_refused_if_there_are_several(tmp_path: Path) -> None:
    part = {"agents": "*", "learner": LEARNER}
    path = tmp_path / "trained.npz"
    np.savez(path, **of_two_robots(part).team.state_dict())
    with pytest.raises(ValueError, match=r"learner\.parts\[0\]\.team = .*roles") as caught:
        of_two_robots({**part, "team": str(path)})
    assert "\n" not in str(caught.value)


def test_other_weights_are_another_trial(kept: Path) -> None:
    def identity() -> str:
        part = {"agents": "*", "learner": LEARNER, "team": str(kept)}
        return trials_of(Spec.of(mixed(part)))[0].identity

    before = identity()
    with np.load(kept) as arrays:
        changed = {**arrays, "learner.theta": arrays["learner.theta"] + 1.0}
    with open(kept, "wb") as file:
        np.savez(file, allow_pickle=False, **changed)
    assert identity() != before


@pytest.mark.parametrize(
    ("learner", "content", "complaint"),
    [
        (
            {**LEARNER, "weights": "own"},
            None,
            r"learner\.parts\[0\]\.team = .* learner\.theta has",
        ),
        (
            {"kind": "frozen", "weights": "own"},
            None,
            r"'role', teams of other sizes can share weights",
        ),
        (LEARNER, b"PK nothing", r"learner\.parts\[0\]\.team = .*"),
        (LEARNER, b"text", r"trained\.npz: is not a saved team"),
    ],
)
def test_a_file_that_holds_no_such_weights_is_refused(kept, learner, content, complaint) -> None:
    if content is not None:
        kept.write_bytes(content)
    with pytest.raises(ValueError, match=complaint) as caught:
        check_conditions(Spec.of(mixed({"agents": "*", "learner": learner, "team": str(kept)})))
    assert "\n" not in str(caught.value)


def test_agents_that_leave_have_the_recovery_table_of_wheels(tmp_path: Path) -> None:
    spec = {
        **LINE_UP, "study": "wheel-failure", "seeds": 2, "episodes": 24, "learner": LEARNER,
        "topology": {
            "kind": "chain",
            "failures": [{"kind": "left", "agents": "cart2", "episode": 12, "action": "zero"}],
        },
    }  # fmt: skip
    study = run(spec, tmp_path / "out", jobs=1, progress=False)
    titles = study.table().titles
    assert {"success before", "success just after", "success at the end"} <= set(titles)
