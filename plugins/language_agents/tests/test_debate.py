"""The debate of agents that err: exact values, and what is measured of them."""

import sys
from pathlib import Path

import numpy as np
import pytest

from nested_agents.core.agents.loop import control_loop
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import arrange

FOLDER = Path(__file__).resolve().parents[1] / "debate"
sys.path.insert(0, str(FOLDER))

from debate import exact  # noqa: E402 - an example

STUDIES = ("debate", "leader", "ten")
SPECS = [path for path in sorted(FOLDER.glob("*.toml")) if path.stem not in STUDIES]


def test_five_topologies_are_specs_of_few_lines() -> None:
    assert [path.stem for path in SPECS] == [
        "all-to-all", "centralised", "chain", "independent", "ring"
    ]  # fmt: skip
    assert all(len(path.read_text().splitlines()) < 15 for path in SPECS)


def test_exact_values_are_those_worked_by_hand() -> None:
    p, q, r = errors = (0.1, 0.2, 0.4)
    alone = Hierarchy("abc", [])
    two_or_more = p * q * (1 - r) + p * (1 - q) * r + (1 - p) * q * r + p * q * r
    assert exact(alone, errors) == pytest.approx(two_or_more)
    assert exact(alone, errors, "last") == pytest.approx(r)
    assert exact(alone, errors, "all") == pytest.approx(1 - (1 - p) * (1 - q) * (1 - r))
    # the center hears both others: it is wrong if most of the three drafts are
    center = Hierarchy("abc", [("a", "c"), ("b", "c")])
    assert exact(center, errors, "last") == pytest.approx(two_or_more)
    # neighbors hear each other from the second round on
    pairs = Hierarchy("abc", [], [("a", "b"), ("a", "c"), ("b", "c")])
    assert exact(pairs, errors, "all") == exact(alone, errors, "all")
    assert exact(pairs, errors, "all", rounds=2) == pytest.approx(two_or_more)


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_what_is_measured_is_what_is_exact(path: Path) -> None:
    spec = Spec.load(path, ["scenario.players=5"])
    with spec.sources.active():
        there = arrange(spec.conditions()[0].settings, 0)
    errors = np.linspace(0.1, 0.4, 5)
    expected = exact(there.team.hierarchy, errors, spec.conditions()[0].settings.scenario.speaks, 3)
    episodes = 800
    records = control_loop(
        there.scenario, there.team, episodes=episodes, steps=3, seed=1, learn=False
    )
    wrong = [record.transition.info["amplification"] * 0.25 for record in records if record.last]
    deviation = np.sqrt(expected * (1 - expected) / episodes)
    assert np.mean(wrong) == pytest.approx(expected, abs=3 * deviation)
