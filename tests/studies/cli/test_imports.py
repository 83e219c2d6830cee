"""Commands that only read import what they use and no more: they answer at once."""

import json
import subprocess
import sys

import made_up
import pytest
from made_up_commands import run_here

from nested_agents.studies.spec.tables import dumps

STUDY = "STUDY"
LOADED = [
    (["--version"], set()),
    (["--help"], set()),
    (["presets"], set()),
    (["status", STUDY], set()),
    (["topology", "list"], {"numpy", "pydantic", "rich"}),
    (["cost"], {"numpy", "pydantic", "rich", "core.agents.team", "pandas"}),
    (
        ["topology", "show", "chain"],
        {"numpy", "pydantic", "rich", "core.agents.team", "networkx", "pandas"},
    ),
    (
        ["results", STUDY],
        {"numpy", "pydantic", "rich", "core.agents.team", "networkx", "pandas"},
    ),
    (
        ["table", STUDY],
        {"numpy", "pydantic", "rich", "core.agents.team", "networkx", "pandas", "scipy"},
    ),
]
"""Commands, one after the other in one process, and what may be loaded after each."""

SLOW = {
    "Box2D", "dask", "gymnasium", "joblib", "matplotlib", "networkx", "numba", "numpy", "pandas",
    "pydantic", "rich", "scipy", "core.agents.team", "studies.spec.spec",
}  # fmt: skip
"""What takes its time to import; what is ours without the name of the package."""

PROGRAM = """
import contextlib, io, json, sys
from nested_agents.studies.cli.main import main
commands, slow = json.loads(sys.argv[1])
for command in commands:
    with contextlib.redirect_stdout(io.StringIO()):
        status = main(command)
    loaded = {name.removeprefix("nested_agents.") for name in sys.modules}
    print(json.dumps([status, sorted(set(slow) & loaded)]))
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[int, set[str]]]:
    folder = tmp_path_factory.mktemp("imports")
    (folder / "spec.toml").write_text(dumps(made_up.SPEC.table()))
    run_here(made_up.measure, "run", folder / "spec.toml", "--out", folder / "study")
    commands = [[str(folder / "study") if part == STUDY else part for part in c] for c, _ in LOADED]
    given = json.dumps([commands, sorted(SLOW)])
    line = [sys.executable, "-c", PROGRAM, given]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    return [(status, set(names)) for status, names in map(json.loads, done.stdout.splitlines())]


@pytest.mark.parametrize("number", range(len(LOADED)), ids=lambda n: " ".join(LOADED[n][0]))
def test_a_command_imports_no_more_than_it_uses(
    found: list[tuple[int, set[str]]], number: int
) -> None:
    status, names = found[number]
    assert status == 0
    assert names <= LOADED[number][1]
