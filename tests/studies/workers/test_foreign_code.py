"""Trials that run installed modules of users, in surroundings that users and parents choose."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from nested_agents.core.plugins import trust
from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec import foreign_code
from nested_agents.studies.spec.outline import changed, present
from nested_agents.studies.trials.episodes import join_measures

ROOT = Path(__file__).resolve().parents[3]

ARM = '''
import os
import random

import numpy as np

import helping
import nested_agents as na

os.chdir("/")


class Arm(na.Scenario, na.Prediction):
    """A walker on a line; one of its measures shows the surroundings of its trial."""

    class Settings(na.ScenarioSettings):
        pass

    agents = ("arm",)
    action_set = na.ActionSet()
    state_space = na.StateSpace("place", (na.Variable("place", "m", -1, 1),), n_own=1)
    measures = (na.SUCCESS, na.Measure("draw", "draw", "1", "draw"))

    def __init__(self, settings):
        os.chdir("/usr")

    def reset(self, seed, episode=0):
        self.place = np.random.default_rng(seed).uniform(-1, 1)
        return np.array([[self.place]])

    def moved(self, actions):
        moves = 0.1 * np.array([1, -1, 0, 0])[actions]
        return np.clip(self.place + moves, -1, 1)

    def step(self, joint_action):
        self.place = self.moved(joint_action)[0]
        draw = random.random() + np.random.rand() + hash("text") % 97 + helping.N
        states = np.array([[self.place]])
        return na.Transition(states, -abs(self.place), False, False, {"draw": draw})

    def predict(self):
        return self

    def states(self, agent, joint_actions):
        return self.moved(joint_actions)
'''
SPEC = """
study = "learning-curve"
seeds = 2
episodes = 2
steps = 3
evaluation = 1
scenario.kind = "robots.arm:Arm"
"""
TABLE = {"scenario": {"kind": "robots.arm:Arm"}}


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A package of a user and a module that it imports, on the path of new processes."""
    site = tmp_path / "site"
    (site / "robots").mkdir(parents=True)
    (site / "robots" / "__init__.py").touch()
    (site / "robots" / "arm.py").write_text(ARM)
    (site / "helping.py").write_text("import json\n\nN = 1\n")
    paths = [str(site), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.syspath_prepend(site)
    for name in ("robots", "robots.arm", "helping"):  # those of another test
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(SPEC)
    return site


def run(out, **environment):
    """Run the study by a parent that ignores SIGCHLD; return its rows."""
    done = subprocess.run(
        [sys.executable, "-m", "nested_agents", "run", "study.toml", "--out", out],
        env={**os.environ, **environment}, capture_output=True, text=True, check=False,
        preexec_fn=lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert main(["export", out, "--format", "csv"]) == 0
    return Path(out, "export", "episodes.csv").read_text()


@pytest.mark.slow
def test_a_module_runs_as_a_file_does_whatever_surrounds_it(installed, capsys):
    rows = run("one", PYTHONHASHSEED="1")
    assert run("two", PYTHONHASHSEED="2") == rows
    (installed / "helping.py").write_text("import json\n\nN = 2\n")
    Path("study.toml").write_text(SPEC.replace("seeds = 2", "seeds = 3"))
    capsys.readouterr()
    assert main(["run", "study.toml", "--out", "one"]) == 2
    assert "helping.py has changed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "text", "is_told"),
    [
        ("helping.py", "import json\n\nN = 2\n", True),
        ("robots/arm.py", ARM.replace("0.1", "0.2"), True),
        ("robots/__init__.py", "X = 1\n", True),
        ("robots/new.py", "", True),
        ("robots/template.py", "{{ no Python }}", True),
        ("unrelated.py", "", False),
    ],
)
@pytest.mark.parametrize("table", [TABLE, {}])
def test_a_change_of_what_a_study_imports_is_told(name, text, is_told, table, installed):
    texts = {} if table else {"mine.py": "from robots import arm\n"}
    before = present(table, texts)
    (installed / name).write_text(text)
    assert changed(before, present(table, texts)) == ([name] if is_told else [])


def test_another_version_of_a_library_is_told(monkeypatch):
    before = present({}, {"mine.py": "import numpy, pandas"})
    assert before["pandas"] == foreign_code._version("pandas")
    monkeypatch.setattr(foreign_code, "version", lambda name: f"9.{name}")
    here = present({}, {"mine.py": "import numpy, pandas"})
    assert {*changed(before, here)} == {*foreign_code.LIBRARIES, "pandas"}


def test_released_packages_are_compared_by_version_and_not_read():
    files, versions = foreign_code.foreign_code({}, {"mine.py": "import matplotlib, yaml"})
    assert not files
    assert versions["matplotlib"] == foreign_code.version("matplotlib")
    assert versions["yaml"] == foreign_code.version("PyYAML")


def test_packages_installed_from_a_folder_are_compared_by_their_files():
    files, versions = foreign_code.foreign_code({}, {"mine.py": "import nested_agents_signals"})
    assert all(name.startswith("nested_agents_signals/") for name in files)
    assert "nested_agents_signals/__init__.py" in files
    assert "nested_agents_signals" not in versions


def test_only_code_of_others_gets_a_process_of_its_own(installed):
    sources = Sources()
    assert not sources.runs_foreign_code
    sources.permit("robots.arm")
    assert sources.runs_foreign_code
    assert sources.only(set()).runs_foreign_code
    assert Sources(texts={"arm.py": ""}).runs_foreign_code
    assert not Sources(texts={"ring.json": "{}"}).runs_foreign_code


def test_code_of_users_does_not_move_this_process(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sources = Sources(texts={"moves.py": "import os\nos.chdir('/')\nX = 1\n"})
    with sources.active():
        assert sources.load("moves.py:X") == 1
        assert Path.cwd() == tmp_path
        os.chdir("/")
    assert Path.cwd() == tmp_path


def test_without_a_home_nothing_is_noted_and_everything_works(monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    text = "a text that nobody has trusted before"
    assert not trust.is_trusted(text)
    trust.trust(text)
    assert trust.is_trusted(text)


@pytest.mark.parametrize("names", [("stride", "Stride"), ("a.b", "c", "A.B")])
def test_columns_that_differ_only_in_case_are_refused(names):
    with pytest.raises(SpecError, match=f"{names[0]!r} and {names[-1]!r}"):
        join_measures([], names)
    assert join_measures([], (*names[:-1], "other")) == ()
