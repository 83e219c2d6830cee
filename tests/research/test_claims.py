"""Claims on made-up results whose verdict is known, and the committed results."""

import json
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from made_up_results import (
    NOTHING,
    Arrays,
    ablation,
    arrays,
    edges,
    games,
    related,
    scaling,
    shapes,
    wheel_failure,
)
from programs import main

from nested_agents.scenarios.box_pushing.scenario import MEASURES
from nested_agents.studies.catalogue.study import load_study
from nested_agents.studies.results import published, results_file
from nested_agents.studies.results.results import Results
from nested_agents.studies.results.statistics import Estimate
from nested_agents.studies.spec.outline import StudyOutline
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.studies import MOVED, STUDIES
from nested_agents.studies.trials.arrangement import check_conditions
from research import QUICK, RESULTS, claims, study_of
from research.claims import (
    OWN,
    PAPERS,
    Finding,
    Measured,
    at_least,
    at_most,
    judge,
    markdown,
    print_claims,
    within,
)

POINTS = Path(__file__).resolve().parents[2] / "examples" / "worlds" / "pushing_points.py"
PAGE = Path(__file__).resolve().parents[2] / "research" / "notebooks" / "claims.md"


def found(value: float, low: float, high: float, p: float | None = None) -> Measured:
    return Measured(Estimate(*map(np.asarray, (value, low, high))), 8, p)


@pytest.mark.parametrize(
    ("criterion", "measured", "verdict"),
    [
        (at_least(0.8), found(0.9, 0.8, 1.0), "holds"),
        (at_least(0.8), found(0.9, 0.79, 1.0), "not decided"),
        (at_least(0.8), found(0.5, 0.4, 0.79), "does not hold"),
        (at_least(0.8), found(0.9, np.nan, np.nan), "not decided"),
        (at_most(1.0), found(0.9, 0.8, 1.0), "holds"),
        (at_most(1.0), found(1.0, 0.8, 1.1), "not decided"),
        (at_most(1.0), found(1.2, 1.1, 1.3), "does not hold"),
        (within(0.1), found(0.0, -0.1, 0.1), "holds"),
        (within(0.1), found(0.0, -0.2, 0.1, p=0.5), "not decided"),
        (within(0.1), found(0.0, -0.1, 0.1, p=0.04), "does not hold"),
        (within(0.1), found(-0.3, -0.4, -0.2), "does not hold"),
    ],
)
def test_criteria_decide_by_the_whole_interval(criterion, measured, verdict) -> None:
    assert criterion.decide(measured) == verdict


def curves(default: float, paper: float, planner: float) -> Arrays:
    rng = np.random.default_rng(5)
    chances = {"own-value": np.linspace(0.0, 4 * default, 20).clip(0, default)}
    others = {"pose": default, "frozen": 0.02, "random": 0.0, "planner": planner, "paper": paper}
    chances |= {c: np.full(20, p) for c, p in others.items()}
    training = {c: arrays(chance, rng) for c, chance in chances.items()}
    training["own-value"]["contact_fraction"][:, :5] -= 0.5 * default - 0.3
    evaluation = {c: arrays(chance[-5:], rng) for c, chance in chances.items()}
    return Arrays(training, evaluation, measures=MEASURES)


def orders(chances: list[float]) -> Arrays:
    return ablation({f"chain:{i}": chance for i, chance in enumerate(chances)}, seeds=100)


GOOD = {"nothing": 0.0, "weights": 1.0, "self-model": 1.0, "both": 1.0}
BAD = {"nothing": 0.0, "weights": 0.1, "self-model": 0.1, "both": 0.1}
FAULTS = ("4 wheels, seized", "4 wheels, reversed")
SYSTEMS = ("nested, observed", "nested, maximum")
RELATIONS = ("told only", "considered only", "considered only, private plans")
COMPUTED = ("cost", "complexity")


@cache
def everything(good: bool) -> dict[str, Results]:
    made = {
        "learning-curve": curves(0.98, 0.9, 0.4) if good else curves(0.2, 0.0, 0.98),
        "chain-order": orders([0.8] * 3) if good else orders([0.9, 0.9, 0.3]),
        "scaling": scaling({2: 1.0, 64: 1.0 if good else 0.1}, 1e-4 if good else 1e-2),
        "wheel-failure": wheel_failure(dict.fromkeys(FAULTS, GOOD if good else BAD)),
        "shapes": shapes({"circle": 0.98, "L": 0.98 if good else 0.2}),
        "related": related(kept=(1.0, 0.2) if good else (0.2, 1.0)),
        "games": games(dict.fromkeys(SYSTEMS, 1.0 if good else 0.1)),
        "edges": edges(0.9, dict.fromkeys(RELATIONS, 0.2 if good else 0.9)),
        "ablation": ablation({"default": 1.0, "static predictor": 1.0 if good else 0.1}),
    }
    return {study: arrays.frames() for study, arrays in made.items()}


@cache
def findings(good: bool) -> tuple[Finding, ...]:
    return judge(everything(good))


@pytest.fixture(scope="module")
def verdicts() -> dict[bool, dict[str, str]]:
    return {good: {f.claim.name: f.verdict for f in findings(good)} for good in (True, False)}


@pytest.mark.parametrize("claim", [c.name for c in PAPERS[OWN] if c.name not in COMPUTED])
def test_every_claim_can_hold_and_can_fail(claim, verdicts) -> None:
    assert verdicts[True][claim] == "holds"
    assert verdicts[False][claim] == "does not hold"


@pytest.mark.parametrize(("good", "verdict"), [(True, "holds"), (False, "does not hold")])
def test_claims_of_another_paper_are_decided_by_its_own_study(good, verdict) -> None:
    names = ("with fill-in", "own edges", "chain", "none", "wrong edges")
    shares = (0.98, 0.98, 0.98, 0.3, 0.3) if good else (0.3, 0.02, 0.98, 0.98, 0.9)
    made = games(dict(zip(names, shares, strict=True))).frames()
    found = judge({"fit": made}, "action-dependency-graphs")
    assert [f.claim.name for f in found] == ["sparse", "enough", "fill-in", "edges", "right"]
    assert {f.verdict for f in found} == {verdict}
    assert {f.result for f in judge({}, "action-dependency-graphs")} == {"no results"}


def test_the_claims_of_a_paper_that_nobody_knows_are_refused(capsys) -> None:
    assert main(["claims", "--of", "mine"]) == 2
    assert "--of = 'mine': known: action-dependency-graphs" in capsys.readouterr().err


def test_the_costs_that_the_paper_prints_are_computed() -> None:
    (finding,) = [f for f in judge({}) if f.claim.name == "cost"]
    assert finding.verdict == "holds"
    assert float(finding.measured.estimate.value) == pytest.approx(2.4575625 / 2.45 - 1.0)


def test_a_chain_of_four_tries_a_third_of_what_joint_action_learners_try() -> None:
    (finding,) = [f for f in judge({}) if f.claim.name == "complexity"]
    assert finding.verdict == "holds"
    assert float(finding.measured.estimate.value) == (4 + 16 + 64 + 256) / (4 * 256)


def test_the_worst_game_decides() -> None:
    results = games({"nested, observed": 1.0}, {"climbing": 1.0, "penalty:-100": 0.0}).frames()
    (finding,) = [f for f in judge({"games": results}) if f.claim.name == "optimum"]
    assert finding.verdict == "does not hold"
    assert finding.measured.note == "penalty:-100"


def test_without_results_nothing_is_decided() -> None:
    found = {f.verdict for f in judge({}) if f.claim.name not in COMPUTED}
    assert found == {"not decided"}


def test_what_a_relation_buys_is_a_mean_over_sizes_of_own_value() -> None:
    made = edges(1.0, {"told only": 0.0})
    for robots in (4, 8):
        condition = f"value_of=own, robots={robots}"
        made.phases["evaluation:told only"][condition]["success"][:] = robots == 8
    results = {"edges": made.frames()}
    (finding,) = [f for f in judge(results) if f.claim.name == "considering"]
    assert float(finding.measured.estimate.value) == 0.5
    assert finding.measured.note == "2 sizes"


def test_few_seeds_decide_nothing() -> None:
    results = {"ablation": ablation({"default": 1.0, "static predictor": 0.0}, seeds=4).frames()}
    (finding,) = [f for f in judge(results) if f.claim.name == "model"]
    assert finding.measured.estimate.high < 0.8
    assert finding.verdict == "not decided"


def is_study(named: str, study: str) -> bool:
    """Whether the name in a spec is that of a study, or its place in research/."""
    return named == study or study_of(study).endswith(named.rpartition("/")[2])


def spec_of(study: str, folder: Path | None = None) -> Spec:
    """The spec of a study as it comes with it, or as it stands in a folder."""
    name = study.replace("-", "_")
    return Spec.load(folder / f"{name}.toml" if folder else claims.spec_of_study(study))


def test_claims_name_studies_and_conditions_that_their_specs_have() -> None:
    for study in claims.studies_of():
        for folder in (None, QUICK):
            spec = spec_of(study, folder)
            assert is_study(spec.study, study)
            labels = {condition.label for condition in spec.conditions()}
            wanted = {
                "learning-curve": {"own-value", "frozen", "random", "planner", "paper"},
                "ablation": {"default", "static predictor"},
                "related": {"nested", "pushing points, team"},
                "games": {f"{s}, game=climbing" for s in SYSTEMS} if folder is QUICK else set(),
                "wheel-failure": {f"{f}, enabled={e}" for f in FAULTS for e in ("true", "false")},
            }.get(study, set())
            assert wanted <= labels
            assert study != "edges" or {*RELATIONS} <= {*spec.evaluations}
            if folder is QUICK:
                check_conditions(spec)


def test_published_results_give_the_table_that_the_run_gave() -> None:
    results = everything(True)
    again = {
        study: published.loads(published.dumps(StudyOutline.of(spec_of(study)), found))
        for study, found in results.items()
    }
    assert all(is_study(p.outline.study, study) for study, p in again.items())
    once = {study: p.results for study, p in again.items()}
    twice = {
        study: published.loads(published.dumps(p.outline, p.results)).results
        for study, p in again.items()
    }
    judged = judge(once)
    assert markdown(judged) == markdown(judge(twice))
    assert [f.verdict for f in judged] == [f.verdict for f in findings(True)]


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    for text in ("{}", "not JSON", "[]"):
        (tmp_path / "shapes.json").write_text(text)
        with pytest.raises(ValueError, match=r"shapes\.json: holds no published results"):
            published.load(tmp_path / "shapes.json")


def test_results_of_another_version_are_told(tmp_path: Path, capsys, monkeypatch) -> None:
    old = RESULTS / "chain-order.json"
    monkeypatch.setattr(results_file, "RESULTS_VERSION", 99)
    assert main(["table", str(old)]) == 0
    assert "chain-order.json: results of version 4, this is version 99" in capsys.readouterr().err
    shutil.copy(old, tmp_path)
    monkeypatch.setattr(claims, "RESULTS", tmp_path)
    assert main(["claims", "--format", "markdown"]) == 0
    assert "chain-order.json: results of version 4, this is version 99" in capsys.readouterr().err


def test_options_that_run_need_a_directory(capsys) -> None:
    assert main(["claims", "--quick"]) == 2
    assert "--quick: needs --out" in capsys.readouterr().err


def test_the_committed_results_make_the_page(capsys) -> None:
    files = list(RESULTS.glob("*.json"))
    assert {path.stem for path in files} == {
        *claims.studies_of(),
        "fit",
        "fit-landmarks",
        "fit-arms",
        "fit-three-actions",
        "fit-boxes",
        "fit-games",
        "fit-rings",
        "fit-games-ppo",
        "fit-ring-ppo",
        "equal-computing-boxes",
        "equal-computing-arms",
        "equal-computing-arms-8",
        "equal-computing-arms-16",
        "equal-computing-16",
        "equal-computing-32",
        "equal-computing-teams",
        "equal-computing-unlimited",
        "edges-classes",
        "edges-hierarchies",
        "edges-arms",
        "edges-games",
        "edges-broken",
        "edges-again",
        "disagreement-8",
        "edges-again-4",
        "edges-again-team",
        "edges-again-4-team",
        "edges-again-8",
        "edges-arms-again",
        "edges-games-again",
        "tasks-written",
        "hand-written",
        "hand-written-200",
        "own-relation-games",
        "own-relation-arms",
        "own-relation-4",
        "own-relation",
        "disagreement-2",
        "disagreement-4",
        "pendulum-written",
        "signals",
        "edges-sixteen",
        "orders-arm",
        "orders-arm-ppo",
        "orders-boxes",
        "orders-game",
        "orders-game-ppo",
        "orders-line",
        "orders-line-ppo",
        "orders-line-again",
        "arms",
        "arm-transfer",
        "long-arms",
        "thousand-arms",
        "tasks",
        "readings",
        "paper-ladder",
        "paper-ladder-unprinted",
        "paper-ladder-even",
        "paper-ladder-100",
        "told",
        "costs",
        "controls",
        "own-value",
        "crowds",
        "peers-arm",
        "peers-arm-16",
        "peers-boxes",
        "transfer",
        "curriculum",
        "four-robots-hard",
        "large-team",
        "sixty-four",
        "from-eight",
        "from-eight-128",
        "rounds",
        "wide",
        "leaders",
        "leaders-128",
        "leaders-128-none",
        "leaders-256",
        "peers-tuning",
        "peers-tuning-arm",
        "peers-tuning-arm-fuzzy",
        "peers-one-robot",
        "peers-four-robots",
        "peers-100",
        "peers-arm-long",
        "peers-predictors",
        "predictors",
        "predictors-again",
        "predictors-arm",
        "predictors-controls",
        "predictors-teams",
        "predictors-teams-three",
        "predictors-eight",
        "poses",
        "poses-controls",
        "poses-controls-4",
        "poses-controls-8",
        "poses-4",
        "poses-8",
        "poses-16",
        "pendulum",
        "cartpole",
        "spread",
        "spread-ppo",
        "swimmer",
        "swimmer-4",
        "swimmer-n",
        "swimmer-transfer",
        "multiwalker",
        "aloha",
        "aloha-copies",
        "aloha-ppo",
        "predictors-pendulum",
        "predictors-pendulum-midpoint",
        "predictors-cartpole",
        "predictors-cartpole-long",
        "predictors-cartpole-fine",
        "predictors-midpoint",
        "peers-plans",
        "locked-joint",
        "large-failures",
        "wheel-failure-poses",
        "climbing",
        "hierarchies",
        "related-arms",
        "related-boxes",
        "related-seized",
    }
    assert all(path.stat().st_size < 300_000 for path in files)
    assert main(["claims", "--format", "markdown"]) == 0
    table = capsys.readouterr().out.strip()
    page = PAGE.read_text(encoding="utf-8")
    assert table in page, (
        "claims.md: put in the table of python -m research.claims --format markdown"
    )


@pytest.mark.parametrize("form", ["table", "json"])
def test_the_table_is_printed_in_every_form(form, capsys, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    print_claims(findings(True), form)
    out = capsys.readouterr().out
    if form == "json":
        records = json.loads(out)
        assert [record["name"] for record in records] == [claim.name for claim in PAPERS[OWN]]
        assert records[0]["low"] <= records[0]["value"] <= records[0]["high"]
    else:
        assert max(map(len, out.splitlines())) <= 80
        assert "does not" in out


def test_every_study_can_be_loaded() -> None:
    for name in STUDIES.names():
        study = load_study(name)
        assert callable(study.measure)
        assert study.analyse(NOTHING).table == ()


TINY = """
study = "{study}"
seeds = 2
episodes = {episodes}
steps = 2
evaluation = 1
{rest}
"""
REST = {
    "learning-curve": 'sweep.preset = ["own-value", "frozen"]',
    "chain-order": 'sweep.topology = ["chain", "chain:reversed"]',
    "ablation": '[[overrides]]\nname = "default"\n'
    '[[overrides]]\nname = "static predictor"\nscenario.predictor = "static"',
    "shapes": 'evaluations.circle.box = "circle"',
    "games": '[scenario]\nkind = "matrix-game"\n[learner]\nkind = "td-lambda"\ndiscount = 0.0\n'
    'rule_base.order = "full"\ndecision.value_of = "own"\n'
    '[[overrides]]\nname = "nested, observed"\nsweep.scenario.game = ["climbing"]',
    "edges": '[learner]\nweights = "role"\ndecision.evaluator = "best-response"\n'
    '[sweep]\nlearner.decision.value_of = ["own"]\n'
    '[evaluations]\n"told only".topology.lookahead = "none"',
    "related": 'evaluations.star.box = "star"\n[[overrides]]\nname = "nested"\n'
    '[[overrides]]\nname = "pushing points, team"\n'
    f'scenario = {{ kind = "{POINTS}:PushingPoints", observed = "joint" }}',
    "scaling": '[[overrides]]\nname = "exact"\nsweep.scenario.robots = [1, 2]',
    "wheel-failure": "scenario.failures = "
    '[{kind = "seized", wheels = "robot1.left", episode = 5}]\n'
    "sweep.learner.self_model.enabled = [false, true]",
}


@pytest.mark.slow
def test_studies_are_run_read_again_and_published(tmp_path, capsys, monkeypatch) -> None:
    (tmp_path / "quick").mkdir()
    for study, rest in REST.items():
        episodes = 10 if study == "wheel-failure" else 1
        text = TINY.format(
            study=study_of(study) if study in MOVED else study, episodes=episodes, rest=rest
        )
        (tmp_path / "quick" / f"{study.replace('-', '_')}.toml").write_text(text)
    monkeypatch.setattr(claims, "QUICK", tmp_path / "quick")
    monkeypatch.setattr(claims, "RESULTS", tmp_path / "published")
    arguments = ["claims", "--quick", "--out", str(tmp_path / "out"), "--jobs", "1"]
    arguments += ["--format", "markdown"]
    assert main(arguments) == 0
    first = capsys.readouterr()
    assert first.out.count("**not decided**") + first.out.count("**does not hold**") >= 5
    assert "learning-curve: 2 conditions x 2 seeds" in first.err
    assert main(arguments) == 0
    again = capsys.readouterr()
    assert again.out == first.out
    assert "4 of 4 trials were run before" in again.err
    for study in REST:
        folder = tmp_path / "out" / study
        assert main(["export", str(folder), "--format", "json"]) == 0
        (tmp_path / "published").mkdir(exist_ok=True)
        (folder / "export" / "results.json").rename(tmp_path / "published" / f"{study}.json")
    capsys.readouterr()
    assert main(["claims", "--format", "markdown"]) == 0
    assert capsys.readouterr().out == first.out
