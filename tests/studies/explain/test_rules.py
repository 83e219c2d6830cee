from itertools import combinations, product

import numpy as np
import pytest

from nested_agents.core.interface.spaces import Variable
from nested_agents.core.rules.kernels.fuzzy import Partition
from nested_agents.core.rules.rule_base import RuleBase
from nested_agents.studies.explain.team import labels, rules_table, take_apart

PARTITIONS = [
    Partition((0.0, 1.0), "triangular"),
    Partition((0.0, 0.3, 1.0), "triangular"),
    Partition((-2.0, 0.0, 2.0), "triangular", period=2 * np.pi),
    Partition((0.0, 0.5, 0.7, 1.0), "triangular"),
]
VARIABLES = [
    Variable("lamp", "1", 0.0, 1.0),
    Variable("gap", "m", 0.0, 1.0, centres=(0.0, 0.3, 1.0), labels=("touching", "near", "far")),
    Variable("turn", "rad", -np.pi, np.pi, periodic=True),
    Variable("speed", "m/s", 0.0, 1.0),
]


def base(*orders):
    return RuleBase(PARTITIONS, [t for order in orders for t in combinations(range(4), order)])


def theta_for(rules):
    return np.random.default_rng(0).normal(size=rules.n_rules)


def corners():
    return np.array(list(product(*(p.centres for p in PARTITIONS))))


def test_the_parts_add_up_to_f():
    rules = base(1)
    theta = theta_for(rules)
    parts = take_apart(rules, theta)
    states = np.random.default_rng(1).uniform(-1, 2, size=(50, 4))
    strengths = [p.strengths(states[:, j]) for j, p in enumerate(PARTITIONS)]
    f = parts.constant + sum(s @ g for s, g in zip(strengths, parts.singles, strict=True))
    assert np.allclose(f, rules.values(theta, states), atol=1e-12)
    assert parts.rest == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("orders", [(1,), (2,), (3,), (4,), (1, 3), (2, 3)])
def test_variance_and_functions_of_one_variable_are_those_of_all_rules(orders):
    rules = base(*orders)
    theta = theta_for(rules)
    parts = take_apart(rules, theta)
    f = rules.values(theta, corners()).reshape([p.size for p in PARTITIONS])
    assert parts.variance == pytest.approx(f.var(), rel=1e-12)
    assert parts.constant == pytest.approx(f.mean(), rel=1e-9)
    for j, single in enumerate(parts.singles):
        others = tuple(i for i in range(4) if i != j)
        assert np.allclose(single, f.mean(axis=others) - f.mean(), atol=1e-12)
    assert (parts.rest > 0.05) == (max(orders) > 1)


def test_words_for_membership_functions():
    words = [labels(v, p) for v, p in zip(VARIABLES, PARTITIONS, strict=True)]
    assert words == [
        ("low", "high"),
        ("touching", "near", "far"),
        ("about -115°", "about 0°", "about 115°"),
        ("about 0 m/s", "about 0.5 m/s", "about 0.7 m/s", "about 1 m/s"),
    ]
    even = Partition.of(VARIABLES[1], count=3)
    assert labels(VARIABLES[1], even) == ("low", "medium", "high")


def test_rules_in_words():
    rules = base(1)
    theta = np.zeros((2, rules.n_rules))
    theta[:, 2:5] = [[0.02, 0.0, -0.02], [0.04, 0.0, -0.04]]
    parts = [take_apart(rules, row) for row in theta]
    agents = ["robot1.left", "robot1.front-right"]
    lines = rules_table(rules, VARIABLES, agents, parts).splitlines()
    assert [line.split() for line in lines[:2]] == [["robot1", "robot1"], ["left", "front-right"]]
    assert lines[2].split() == ["gap,", "share", "of", "the", "variance", "100", "%", "100", "%"]
    assert lines[3].split() == ["IF", "gap", "is", "touching,", "0", "m:", "+2.00", "+4.00"]
    assert lines[5].split() == ["IF", "gap", "is", "far,", "1", "m:", "-2.00", "-4.00"]


def test_many_agents_stand_in_blocks():
    rules = base(1)
    parts = [take_apart(rules, theta_for(rules))] * 12
    names = [f"robot{i}.middle-right" for i in range(12)]
    table = rules_table(rules, VARIABLES, names, parts)
    assert max(len(line.rstrip()) for line in table.splitlines()) <= 80
    assert table.count("robot") == 12
