"""Specs mutated at random: whatever they hold is accepted, or refused in one line."""

import copy
import math
import os
import time
import tomllib
from pathlib import Path

import made_up
import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from nested_agents import studies
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions

EXAMPLES = int(os.environ.get("FUZZED_SPECS", "200"))
BUDGET = 0.5 * EXAMPLES
"""Seconds of the processor after which no further spec is built: a few are of huge teams."""

RICH = """
study = "learning-curve"
preset = "paper"
seeds = [3, 5]
episodes = 4
steps = 50
evaluation = 2

[scenario]
robots = 2
robot = "four-wheel"
box = { vertices = [[0, 0], [0.2, 0], [0.2, 0.1]], mass = 0.5 }
start = "easy"
hold = 4
lookahead = 2
reward = { c1 = 0.02, receding = 0.0 }
failures = [{ kind = "weak", gain = 0.3, wheels = ["robot1.*"], episode = 1, end_episode = 2 }]

[topology]
kind = "chain"
order = "reversed"

[learner]
kind = "td-lambda"
step_size = 0.1
rule_base = { membership = "triangular", memberships = 3, order = 1 }
exploration = { kind = "paper", decay = 0.1 }
decision = { rule = "value", others = "observed" }

[sweep]
"learner.discount" = [0.9, 0.99]
"""
BASES = [
    tomllib.loads(RICH),
    made_up.SPEC.table(),
    *(
        tomllib.loads(path.read_text())
        for path in sorted(Path(studies.__file__).parent.glob("*.toml"))
        if path.name not in ("scaling.toml", "ablation.toml")  # their teams take long to build
    ),
]

WORDS = st.sampled_from(
    ["seeds", "steps", "preset", "default", "paper", "robots", "box", "kind", "frozen", "sweep",
     "learner.ridge", "topology", "name", "chain", "tree:2", "teams", "robot1.left", "*", "", ".",
     "a.b", "\n", "é", "🤖", "\x00", "\ud800", "'", '"', "[", "{x}", "%s", "x" * 500]
)  # fmt: skip
NUMBERS = st.sampled_from(
    [0, 1, -1, 2, 7, 100, 5000, 10**6, 2**31, 2**63, 2**64, -(2**63), 10**30,
     0.0, -0.0, 0.5, -1.5, 1e-320, 1e-12, 1e12, 1e308, math.inf, -math.inf, math.nan]
)  # fmt: skip
VALUES = st.recursive(
    WORDS | NUMBERS | st.booleans() | st.text(max_size=5) | st.none(),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(WORDS | st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=8,
)


def places(table, path=()):
    """Every key of every table and every index of every list, by the path to it."""
    items = table.items() if isinstance(table, dict) else enumerate(table)
    for key, value in list(items):
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


def parent(table, path):
    for key in path[:-1]:
        table = table[key]
    return table


@st.composite
def mutated(draw):
    """A valid spec with one to four changes: removed, added, replaced, moved, wrapped, deepened."""
    table = copy.deepcopy(draw(st.sampled_from(BASES)))
    for _ in range(draw(st.integers(1, 4))):
        found = list(places(table))
        if not found:
            break
        path = draw(st.sampled_from(found))
        holder, key = parent(table, path), path[-1]
        change = draw(
            st.sampled_from(
                ["remove", "add", "replace", "number", "number", "move", "wrap", "deepen"]
            )
        )
        if change == "remove":
            del holder[key]
        elif change == "add" and isinstance(holder, dict):
            holder[draw(WORDS)] = draw(VALUES)
        elif change == "add":
            holder.append(draw(VALUES))
        elif change == "number":
            numbers = [p for p in found if type(parent(table, p)[p[-1]]) in (int, float)]
            for path in [draw(st.sampled_from(numbers))] if numbers else []:
                kind = type(parent(table, path)[path[-1]])
                parent(table, path)[path[-1]] = draw(NUMBERS.filter(lambda n, k=kind: type(n) is k))
        elif change == "replace":
            holder[key] = draw(VALUES)
        elif change == "move":
            other = draw(st.sampled_from(found))
            holder[key] = copy.deepcopy(parent(table, other)[other[-1]])
        elif change == "wrap":
            holder[key] = [holder[key]] * draw(st.integers(0, 3))
        else:
            for _ in range(draw(st.sampled_from([1, 3, 20]))):
                holder[key] = {"x": holder[key]}
    return table


used: list[float] = []
"""Seconds of the processor that every spec took."""


@pytest.mark.timeout(1800)
@settings(max_examples=EXAMPLES, suppress_health_check=[HealthCheck.too_slow])
@given(mutated())
def test_a_mutated_spec_is_accepted_or_refused_in_one_line(table):
    before = copy.deepcopy(table)
    begin = time.process_time()
    try:
        spec = Spec.of(table)
        if len(spec.conditions()) <= 12 and sum(used) < BUDGET:
            check_conditions(spec)
        event("accepted")
    except SpecError as error:
        event("refused")
        message = str(error)
        assert message.strip()
        assert message == " ".join(message.split())
        assert message.isprintable()
        assert len(message) < 2000
    finally:
        used.append(time.process_time() - begin)
    assert repr(table) == repr(before)


@pytest.mark.parametrize("depth", [50, 400, 3000])
@pytest.mark.parametrize(
    "text",
    ["scenario.{keys}x = 1", "sweep.{keys}x = [1]", "seeds = {lists}", "learner.a = {lists}"],
)
def test_depth_is_refused_in_one_line(text, depth):
    lists = "[" * depth + "]" * depth
    with pytest.raises(SpecError, match=r"unknown key|too deeply|whole number"):
        Spec.parse(text.format(keys="x." * depth, lists=lists))
