"""Whatever stands for an argument of a public function: one line names it, and what is allowed."""

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from traceback import walk_tb

import pytest

import nested_agents as na

WRONG = (None, 3, [], object())
SCENARIO = na.BoxPushingSettings().build()
HIERARCHY = na.build_hierarchy("chain", SCENARIO.agents)
SEED = na.policy_seed(0)
SPEC = {"seeds": 1, "episodes": 1, "steps": 2, "evaluation": 1, "scenario": {"kind": "line-up"}}
SCORES = [[1.0, 0.0], [1.0, 1.0]]
VALID: dict[str, dict[str, object]] = {
    "BoxPushing": {"settings": na.BoxPushingSettings()},
    "Hierarchy": {"agents": ("a", "b"), "edges": [("a", "b")]},
    "KinematicChain": {"settings": na.KinematicChainSettings()},
    "Session": {"trial": None},
    "Team": {
        "settings": na.BatchTDSettings(), "scenario": SCENARIO, "hierarchy": HIERARCHY,
        "seed": SEED,
    },
    "bootstrap": {"values": SCORES},
    "build_hierarchy": {"settings": "tree:2", "agents": ["a", "b", "c"], "bodies": None},
    "check_scenario": {"factory": na.LineUpSettings().build, "steps": 3, "seeds": (0, 1)},
    "compare_table": {"table": "none.csv"},
    "cost_table": {"topologies": ["chain"], "agents": [2], "actions": [4], "memberships": [3]},
    "control_loop": {
        "scenario": SCENARIO, "team": None, "episodes": 1, "steps": 1, "seed": 0,
    },
    "detectable": {"deviation": 0.25, "seeds": 15, "comparisons": 1},
    "explain_decision": {"decision": None},
    "from_gymnasium": {"env": None},
    "from_pettingzoo": {"env": None},
    "keys": {"prefix": "scenario"},
    "load": {"places": None},
    "parse_topology": {"text": "chain"},
    "plan": {"spec": SPEC},
    "policy_seed": {"seed": 0},
    "power": {"effect": 0.2, "deviation": 0.25, "seeds": 5, "comparisons": 1},
    "profile": {"spec": SPEC},
    "rate": {"outcomes": SCORES},
    "reevaluate": {"study": "none"},
    "run": {"spec": SPEC, "out": "out"},
    "run_trial": {"trial": None},
    "scaling_law": {"study": None},
    "schema": {},
    "seeds_for": {"effect": 0.2, "deviation": 0.25, "comparisons": 1},
    "state_variable": {"unit": "m", "low": 0.0, "high": 1.0},
    "tune": {"spec": SPEC, "out": "out"},
}  # fmt: skip
"""What a call may be given, by function; None where only wrong values are tried."""
INNER = {"choice", "greatest"}
"""Functions for authors of scenarios and learners, which do not check their arguments."""


def test_every_public_function_is_tried() -> None:
    functions = {name for name in na.__all__ if inspect.isfunction(getattr(na, name))}
    assert functions - INNER <= set(VALID)


def calls() -> Iterator[tuple[str, str, object]]:
    for name, arguments in VALID.items():
        for argument in arguments:
            for wrong in WRONG:
                yield name, argument, wrong


def refusal(name: str, argument: str, wrong: object) -> Exception | None:
    """Return what a call with a wrong argument raises; None if the argument is fine after all."""
    function = getattr(na, name)
    try:
        result = (
            function(wrong) if argument == "places" else function(**VALID[name] | {argument: wrong})
        )
        if inspect.isgenerator(result):
            next(result)
    except (ValueError, TypeError) as error:
        return error
    return None


@pytest.mark.parametrize(("name", "argument", "wrong"), [*calls()])
def test_a_wrong_argument_is_one_line(
    name: str, argument: str, wrong: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    error = refusal(name, argument, wrong)
    if isinstance(error, TypeError):  # of the call itself, not of what it came to
        assert len([*walk_tb(error.__traceback__)]) == 1, error
    elif error is not None:
        assert re.search("allowed|must|needs|known|no agents|lacks|missing", str(error)), error
        assert "\n" not in str(error)


def test_the_argument_its_value_and_what_is_allowed_are_named() -> None:
    with pytest.raises(ValueError, match=r"^agents = 6, allowed: the names of agents$"):
        na.build_hierarchy("tree:2", **{"agents": 6})


SEQUENCES: dict[tuple[str, str], tuple[object, ...]] = {
    ("bootstrap", "bounds"): (0.0,),
    ("build_hierarchy", "agents"): ("a",),
    ("build_hierarchy", "interactions"): ((0, 1),),
    ("check_scenario", "seeds"): (0,),
    ("check_scenario", "episodes"): (0,),
    ("compare_table", "condition"): ("condition",),
    ("compare_table", "score"): ("score",),
    ("cost_table", "topologies"): ("chain",),
    ("cost_table", "agents"): (2,),
    ("cost_table", "actions"): (4,),
    ("cost_table", "memberships"): (3,),
    ("Hierarchy", "agents"): ("a",),
    ("Hierarchy", "edges"): (("a", "b"),),
    ("Hierarchy", "neighbors"): (("a", "b"),),
    ("state_variable", "centers"): (0.0,),
    ("state_variable", "labels"): ("near",),
}
"""What sequences may begin with, by function and argument."""
JOINED = {"settings": {"kind": "coordination-graph", "shape": "scenario"}, "agents": ["a", "b"]}


@pytest.mark.parametrize("wrong", [None, [], object()])
@pytest.mark.parametrize(("name", "argument"), SEQUENCES)
def test_a_wrong_element_is_named_with_its_index(name, argument, wrong, monkeypatch) -> None:
    monkeypatch.chdir(Path(__file__).parent)
    first = SEQUENCES[name, argument]
    given = VALID[name] | (JOINED if argument == "interactions" else {})
    given |= {argument: [*first, wrong]}

    def call() -> None:
        made = getattr(na, name)(**given)
        made(lambda view, body: 0.0)  # a state variable is made by what this returns

    with pytest.raises(ValueError, match=rf"{argument}\[{len(first)}\] = .*(allowed|must be)") as e:
        call()
    assert "\n" not in str(e.value)


def test_pairs_are_of_two_and_of_indices_that_there_are() -> None:
    with pytest.raises(ValueError, match=r"^edges\[0\] = \['a'\], allowed: pairs of names$"):
        na.Hierarchy(("a", "b"), [("a",)])
    with pytest.raises(ValueError, match=r"interactions\[1\] = \(0, 2\): must be 2 agent"):
        na.build_hierarchy(**JOINED, interactions=[(0, 1), (0, 2)])


def test_elements_given_to_loaded_studies_are_named(tmp_path: Path) -> None:
    kept = na.run(SPEC, tmp_path, jobs=1)
    for call in (
        lambda: kept.table([3]),
        lambda: na.load(tmp_path, columns=[3]),
        lambda: na.scaling_law(kept, predict=["x"]),
    ):
        with pytest.raises(ValueError, match=r"(columns|predict)\[0\] = (3|'x'), allowed: "):
            call()
