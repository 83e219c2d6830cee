"""Scenarios and topologies of users that misbehave, as `benchmarks.adversary` makes them.

A scenario misbehaves in one of two conditions. The other one must finish, and the command must say
that something failed: status 0 although the fault came true is silence.
"""

from __future__ import annotations

import contextlib
import io
import os
import random
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from nested_agents.studies.cli.main import main as command_line
from nested_agents.studies.store.store import Store

from .victim import inline

FIRED = "NESTED_AGENTS_FAULT"
"""Environment variable that a fault sets when it comes true."""
METHODS = ("__init__", "reset", "step", "predict")
ACTS = (
    "sys.exit(0)", "sys.exit(3)", "raise KeyboardInterrupt", "raise BaseException('base')",
    "raise GeneratorExit", "raise StopIteration", "raise RecursionError('deep')",
    "raise MemoryError", "raise ValueError(chr(0xD800))", "raise ValueError('x' * 3_000_000)",
    "raise ValueError('two\\nlines')", "raise Mute", "return None", "return 'text'", "return 0",
    "return np.zeros((9, 9))", "return np.full((2, 2), np.nan)", "return np.full((2, 2), np.inf)",
    "return np.full((2, 2), 1e300)", "return [[0.0], [0.0, 1.0]]",
    "return replace(super().step(*arguments), reward='1.0')",
    "return replace(super().step(*arguments), reward=np.nan)",
)  # fmt: skip
SCENARIO = """
import os, sys
from dataclasses import replace
import numpy as np
import nested_agents as na
from nested_agents.scenarios.line_up import LineUp

class Mute(Exception):
    def __str__(self):
        raise RuntimeError("says nothing")

class Bad(LineUp):
    class Settings(na.ScenarioSettings):
        carts: int = 2
        bad: bool = False

    calls = 0

    def __init__(self, settings):
        self.bad = settings.bad
        super().__init__(settings)

class Worse(Bad):
    def {method}(self, *arguments):
        type(self).calls += 1
        bad = arguments[0].bad if "{method}" == "__init__" else self.bad
        if bad and self.calls >= {after}:
            os.environ["{fired}"] = "1"
            {act}
        return super().{method}(*arguments)
"""
SPEC = """
seeds = 1
episodes = 2
steps = 5
evaluation = 1
scenario.kind = "bad.py:Worse"
sweep.scenario.bad = [false, true]
"""
MUTE = "class Mute({}):\n    def __str__(self): raise RuntimeError\n"
DRAWN = "[(a, b) for a in agents for b in agents if a < b and random.random() < 0.5]"
TOPOLOGIES = (
    "import sys\ndef f(agents, bodies): sys.exit(0)",
    "import sys\nsys.exit(0)\ndef f(agents, bodies): return []",
    "def f(agents, bodies):\n    while True: yield agents[0], agents[-1]",
    "def f(agents, bodies):\n    while True: yield object(), object()",
    "async def f(agents, bodies): return []",
    "async def f(agents, bodies):\n    yield agents[0], agents[-1]",
    MUTE.format("object") + "def f(agents, bodies): return [(Mute(), 'a')]",
    MUTE.format("Exception") + "def f(agents, bodies): raise Mute",
    "def f(agents, bodies): return f(agents, bodies)",
    "def f(agents, bodies): raise BaseException('base')",
    "def f(agents, bodies): raise ValueError(chr(0xD800))",
    "def f(agents, bodies): raise ValueError('x' * 3_000_000)",
    "def f(agents, bodies): return 7",
    "def f(agents, bodies): return [agents]",
    "def f(agents, bodies): return {agents[0]: agents[1:]}",
    "def f(agents, bodies): return [(agents[0], agents[0])]",
    "def f(agents, bodies): return [(agents[0], agents[-1]), (agents[-1], agents[0])]",
    "def f(agents, bodies): return [('nobody', agents[0])]",
    "def f(agents, bodies): return [(chr(27) + '[31m', agents[0])]",
    f"import random\ndef f(agents, bodies): return {DRAWN}",
    "import networkx as nx\ndef f(agents, bodies): return nx.complete_graph(3)",
    "import networkx as nx\ndef f(agents, bodies): return nx.MultiDiGraph([agents[:2]] * 2)",
    "def f(agents): return []",
    "f = 7",
    "def f(agents, bodies)\n    return []",
    "import nothing_of_this_name\ndef f(agents, bodies): return []",
)  # fmt: skip


def scenarios(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Run studies with a scenario that misbehaves; return what became of them."""
    tally = Counter[str]()
    for attempted in range(number):
        tally["scenarios"] += 1
        method, act = rng.choice(METHODS), rng.choice(ACTS)
        place = folder / str(attempted)
        place.mkdir()
        text = SCENARIO.format(method=method, act=act, after=rng.randrange(1, 9), fired=FIRED)
        (place / "bad.py").write_text(text)
        (place / "spec.toml").write_text(SPEC)
        with inline():
            became = _scenario(place)
        tally[f"scenarios: {became}"] += 1
        if became not in ("told", "refused in one line", "not reached"):
            print(f"{method}, {act}: {became}", file=sys.stderr)
    return tally


def _scenario(place: Path) -> str:
    os.environ.pop(FIRED, None)
    out, error = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = command_line(["run", str(place / "spec.toml"), "--out", str(place / "out")])
    except BaseException:
        print(traceback.format_exc(), file=sys.stderr)
        return "traceback"
    message = error.getvalue()
    if status == 2:
        return "refused in one line" if message.count("\n") == 1 else "refused at length"
    with Store.open(place / "out") as store:
        done = store.counts()["done"]
    if FIRED not in os.environ:
        return "not reached" if (status, done) == (0, 2) else "failed without a fault"
    if status == 0:
        return "silence"
    return (
        "told" if (status, done) == (1, 1) and "Traceback" not in message else "other trials lost"
    )


def topologies(rng: random.Random) -> Iterator[Callable[[Path], str]]:
    """Yield Python files of topologies."""
    while True:
        text, agents = rng.choice(TOPOLOGIES), rng.choice([1, 2, 3, 8, 100])

        def attack(folder: Path, text: str = text, agents: int = agents) -> str:
            (folder / "graph.py").write_text(text)
            out, error = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
                line = ["topology", "show", f"{folder / 'graph.py'}:f", "--agents", str(agents)]
                status = command_line(line)
            message = error.getvalue()
            if status == 0:
                return "accepted" if out.getvalue() else "silence"
            one_line = (
                message.count("\n") == 1 and message[:-1].isprintable() and len(message) < 2000
            )
            return "refused in one line" if one_line else "refused at length"

        yield attack
