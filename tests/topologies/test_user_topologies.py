"""Topologies of users: Python files and entry points."""

from importlib import metadata
from importlib.metadata import EntryPoint
from pathlib import Path

import networkx as nx
import pytest

from nested_agents.topologies import TOPOLOGIES, build, parse

AGENTS = ("a", "b", "c", "d")
ROBOTS = ((0, 1), (2, 3))
EXAMPLE = Path(__file__).parents[2] / "examples" / "cohorts.py"


def test_the_example_of_the_documentation() -> None:
    hierarchy = build(parse(f"{EXAMPLE}:cohorts"), AGENTS, ROBOTS)
    assert hierarchy.edges == ((0, 2), (0, 3), (1, 2), (1, 3))
    assert hierarchy.unseen(0) == (1,)
    lines = EXAMPLE.read_text().partition("def ")[2].splitlines()
    assert len(lines) <= 10
    documented = (EXAMPLE.parents[1] / "docs" / "topologies.md").read_text()
    assert "def " + EXAMPLE.read_text().partition("def ")[2].strip() in documented


@pytest.fixture
def written(tmp_path: Path):
    """A function that writes a Python file and returns the topology ``file:f``."""

    def write(source: str) -> str:
        path = tmp_path / "mine.py"
        path.write_text(source)
        return f"{path}:f"

    return write


@pytest.mark.parametrize(
    "body",
    [
        "return [(a, b) for a, b in zip(agents, agents[1:])]",
        "import networkx as nx\n    return nx.path_graph(agents, create_using=nx.DiGraph)",
        "yield from zip(agents, agents[1:])",
    ],
)
def test_pairs_or_a_graph(written, body: str) -> None:
    settings = parse(written(f"def f(agents, groups):\n    {body}\n"))
    assert build(settings, AGENTS).edges == ((0, 1), (1, 2), (2, 3))


def test_an_undirected_graph_is_one_of_neighbors(written) -> None:
    body = "import networkx as nx\n    return nx.cycle_graph(agents)"
    hierarchy = build(parse(written(f"def f(agents, groups):\n    {body}\n")), AGENTS)
    assert hierarchy.edges == ()
    assert hierarchy.neighbors == ((0, 1), (0, 3), (1, 2), (2, 3))


MUTE = "class Mute:\n    def __str__(self): raise RuntimeError('no name')\n"


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("def g(agents, groups): pass", "has no 'f', it has: g"),
        ("import os\n1 / 0", "cannot be run: ZeroDivisionError"),
        ("import sys\nsys.exit('bye')", "cannot be run: SystemExit: bye"),
        ("def f(:", "cannot be run: SyntaxError"),
        ("def f(agents): return []", "f raised TypeError"),
        ("def f(agents, groups): return groups[9]", "f raised IndexError"),
        ("def f(agents, groups): return 3", "f returned int, allowed: a networkx DiGraph"),
        ("def f(agents, groups): return [('a', 'b', 'c')]", "a list of pairs"),
        ("def f(agents, groups): return [('a', 'b')] * 2", "edge a -> b is given more than once"),
        ("def f(agents, groups): return [('a', 'x')]", "unknown agent 'x' in the graph"),
        ("def f(agents, groups): return [('a', 'b'), ('b', 'a')]", "cycle a -> b -> a"),
        (
            "import networkx as nx\ndef f(agents, groups): return nx.path_graph(['a', 'b'])",
            "agent 'c' is missing from the graph",
        ),
        (
            "import networkx as nx\ndef f(agents, groups): return nx.DiGraph([('a', 'b')])",
            "agent 'c' is missing from the graph",
        ),
        ("async def f(agents, bodies): return []", "f returned coroutine, allowed:"),
        ("async def f(agents, bodies): yield 'a', 'b'", "f returned async_generator, allowed:"),
        (
            "def f(agents, bodies):\n    while True: yield 'a', 'b'",
            "f gave more than 16 pairs of 4 agents",
        ),
        (f"{MUTE}def f(agents, bodies): return [(Mute(), 'b')]", "f raised RuntimeError in line 2"),
        (
            f"{MUTE}import networkx as nx\ndef f(agents, bodies): return nx.DiGraph([(Mute(), 1)])",
            "f raised RuntimeError in line 2",
        ),
        ("def f(agents, bodies):\n    yield 1 / 0", "f raised ZeroDivisionError in line 2"),
        (
            "import networkx as nx\n\ndef f(agents, bodies):\n"
            "    return nx.relabel_nodes(nx.path_graph(2), {0: []})",
            "f raised ValueError in line 4",
        ),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_bad_function_is_refused_in_one_line(written, source: str, message: str) -> None:
    text = written(source)
    with pytest.raises(ValueError, match=r".") as refusal:
        build(parse(text), AGENTS, ROBOTS)
    assert message in str(refusal.value)
    assert str(refusal.value).startswith(f"topology {text!r}: ")
    is_run = "has no" not in message and "cannot be run" not in message
    assert str(refusal.value).endswith(" (given 4 agents of 2 bodies)") == is_run
    assert "\n" not in str(refusal.value)


def test_a_file_may_have_dataclasses_and_postponed_annotations(written) -> None:
    text = written(
        "from __future__ import annotations\nfrom dataclasses import dataclass\n"
        "@dataclass\nclass Pair:\n    above: str\n    below: str\n"
        "def f(agents, groups):\n    pair = Pair(*agents[:2])\n"
        "    return [(pair.above, pair.below)]\n"
    )
    assert build(parse(text), AGENTS).edges == ((0, 1),)


def test_a_parameter_after_a_colon_is_refused_with_the_table_that_sets_it() -> None:
    with pytest.raises(ValueError, match=r"mine\.py:f:3.*\{ kind = \"mine\.py:f\", PARAMETER"):
        parse("mine.py:f:3")


@pytest.mark.parametrize("text", ["mine.py:", "mine.py:2f"])
def test_a_source_must_name_file_and_function(text: str) -> None:
    with pytest.raises(ValueError, match=r"must be written path/to/file\.py:name"):
        parse(text)


def path_of(agents, groups):
    """What the made-up package offers."""
    return nx.path_graph(agents, create_using=nx.DiGraph)


def points(*pairs: tuple[str, str]):
    """A stand-in for `importlib.metadata.entry_points`."""
    found = [EntryPoint(name, value, TOPOLOGIES.group) for name, value in pairs]

    def entry_points(group: str, name: str | None = None):
        return [p for p in found if name in (None, p.name)]

    return entry_points


def test_entry_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metadata, "entry_points", points(("line", f"{__name__}:path_of")))
    assert build(parse("line"), AGENTS).edges == ((0, 1), (1, 2), (2, 3))
    with pytest.raises(ValueError, match=r"did you mean 'line'\? known: chain, .*, or a file"):
        parse("lime")


def test_a_function_must_return_the_same_twice(tmp_path: Path) -> None:
    file = tmp_path / "drawn.py"
    file.write_text("calls = []\ndef drawn(agents, groups):\n    calls.append(0)\n"
                    "    return [(agents[0], agents[len(calls)])]\n")  # fmt: skip
    with pytest.raises(ValueError, match="drawn returned another hierarchy when called again"):
        build(parse(f"{file}:drawn"), AGENTS)


def test_bad_entry_points(monkeypatch: pytest.MonkeyPatch) -> None:
    offered = points(("line", "absent_package:f"), ("pi", "math:pi"))
    monkeypatch.setattr(metadata, "entry_points", offered)
    with pytest.raises(ValueError, match="topology 'line': cannot be loaded: ModuleNotFoundError"):
        build(parse("line"), AGENTS)
    with pytest.raises(ValueError, match="is of type float, allowed: topology"):
        build(parse("pi"), AGENTS)
    monkeypatch.setattr(metadata, "entry_points", points(("line", "a:f"), ("line", "b:f")))
    with pytest.raises(ValueError, match="'line' is offered twice: a:f, b:f"):
        parse("line")


def test_keyword_only_parameters_of_a_function_are_its_settings(written) -> None:
    kind = written(
        "from __future__ import annotations\n"
        "def f(agents, groups, *, width: int = 1, unnoted=None):\n"
        "    return [(agents[0], agent) for agent in agents[1 : 1 + width]]\n"
    )
    assert (parse(kind).kind, dict(parse(kind))["width"]) == (kind, 1)
    assert build(parse({"kind": kind, "width": 2}), AGENTS).edges == ((0, 1), (0, 2))
    with pytest.raises(ValueError, match="width = 'two': must be a whole number"):
        parse({"kind": kind, "width": "two"})
