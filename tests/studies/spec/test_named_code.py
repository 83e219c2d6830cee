"""Code that somebody else's spec names in any place, in any spelling: not run without trust."""

import sys
from pathlib import Path

import pytest

from nested_agents.core.plugins import trust
from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec

HARM = """
from pathlib import Path

Path(__file__).with_name("sprung").touch()
"""
PYTHON = """
import subprocess
from subprocess import Popen

import numpy as np


def ring(agents, groups):
    return list(zip(agents, agents[1:]))
"""


@pytest.fixture
def harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Exists once a module has been imported that nobody trusts."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(trust, "_noted", set())
    folder = tmp_path / "installed"
    for name in ("harm.py", "harm-1.py", "harm:two.py", "harms/__init__.py", "harms/one.py"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(HARM)
    monkeypatch.syspath_prepend(folder)
    return folder / "sprung"


def kinds(name: str) -> dict[str, dict]:
    """Specs that name a kind, by where they do."""
    scenario = {"kind": name}
    line = {"kind": "line-up"}
    return {
        "scenario": {"scenario": scenario},
        "states of boxes": {"scenario": {"kind": "box-pushing", "state_space": [name]}},
        "states of arms": {"scenario": {"kind": "kinematic-chain", "state_space": [name]}},
        "topology": {"scenario": line, "topology": {"kind": name}},
        "topology as text": {"scenario": line, "topology": name},
        "learner": {"scenario": line, "learner": {"kind": name}},
        "part of a team": {
            "scenario": line,
            "learner": {"kind": "mixed", "parts": [{"agents": "*", "learner": {"kind": name}}]},
        },
        "exploration": {"scenario": line, "learner": {"exploration": {"kind": name}}},
        "evaluator": {"scenario": line, "learner": {"decision": {"evaluator": name}}},
        "table of an evaluator": {
            "scenario": line,
            "learner": {"decision": {"evaluator": {"kind": name}}},
        },
        "study": {"scenario": line, "study": name},
        "preset": {"scenario": line, "preset": name},
        "sweep": {"sweep": {"scenario.kind": ["line-up", name]}},
        "override": {"overrides": [{"name": "a", "scenario": scenario}]},
        "evaluation": {"scenario": line, "evaluations": {"a": {"topology": {"kind": name}}}},
        "curriculum": {
            "scenario": line,
            "curriculum": [{"name": "a", "episodes": 1, "scenario": scenario}],
        },
    }


@pytest.mark.parametrize(
    "name",
    ["harms.one:Name", "harms.:Name", "harms.one:", ".harms:Name", "harm:Name", "harms.one:a:b"],
)
def test_no_kind_imports_a_module_that_is_not_trusted(name: str, harm: Path) -> None:
    for place, table in kinds(name).items():
        sources = Sources(None, brought_by="theirs")
        with sources.active(), pytest.raises(ValueError) as refused:  # noqa: PT011
            Spec.of(table, sources).conditions()[0].settings.scenario.build()
        assert "\n" not in str(refused.value), place
        assert name.partition(":")[0] in str(refused.value), place
    assert not harm.exists()
    assert not {"harm", "harms", "harms.one"} & {*sys.modules}


@pytest.mark.parametrize("kind", ["gymnasium", "pettingzoo"])
@pytest.mark.parametrize(
    "name",
    ["harm:X", "harm.:X", "harms.one:X-v0", "harm-1:X", "harm:two:X", ".harm:X", "harm.py/:X"],
)
def test_no_environment_imports_a_module_that_is_not_trusted(
    kind: str, name: str, harm: Path
) -> None:
    table = {"scenario": {"kind": kind, "id": name}}
    swept = {"scenario": {"kind": kind, "id": "a"}, "sweep": {"scenario.id": ["a", name]}}
    for each in (table, swept):
        with pytest.raises(SpecError, match=r"^scenario\.id: .*: named by theirs"):
            Spec.of(each, Sources(None, brought_by="theirs"))
    options = {"kind": "gymnasium", "id": "GymV21Environment-v0", "options": {"env_id": name}}
    with pytest.raises(SpecError, match=r"^scenario\.options\.env_id: "):
        Spec.of({"scenario": options}, Sources(None, brought_by="theirs"))
    assert not harm.exists()


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("pettingzoo", "harm-1"),
        ("pettingzoo", "./harm"),
        ("pettingzoo", "harm:two:X"),
        ("gymnasium", "harm:two:X"),
        ("gymnasium", "harm-1:X"),
    ],
)
def test_what_is_no_name_of_a_module_is_not_imported_at_all(
    kind: str, name: str, harm: Path, tmp_path: Path
) -> None:
    spec = Spec.of({"scenario": {"kind": kind, "id": name}}, Sources(tmp_path))
    with pytest.raises(ValueError, match=r"^scenario\.id = .* must be written"):
        spec.conditions()[0].settings.scenario.build()
    assert not harm.exists()


@pytest.mark.parametrize(
    "name", ["gymnasium.core:np.test", "os.path:genericpath.os.system", "harms.one:Path"]
)
def test_a_kind_is_what_a_package_defines(name: str, harm: Path, tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"^scenario\.kind = .*: is (of type|defined in)"):
        Spec.of({"scenario": {"kind": name}}, Sources(tmp_path))


@pytest.mark.parametrize("name", ["subprocess.getoutput", "Popen", "np.test", "subprocess"])
def test_a_trusted_file_lends_a_study_none_of_its_imports(
    name: str, harm: Path, tmp_path: Path
) -> None:
    sources = Sources(None, {"mine.py": PYTHON})
    sources.load("mine.py:ring")  # trusted from now on
    for key in ("scenario", "topology", "learner"):
        with pytest.raises(SpecError, match=r"is (of type|defined in)"):
            Spec.of({key: {"kind": f"mine.py:{name}"}}, sources)
    options = {"args": f"touch {tmp_path / 'called'}", "shell": True}
    table = {"kind": "gymnasium", "id": f"mine.py:{name}", "options": options}
    settings = Spec.of({"scenario": table}, sources).conditions()[0].settings.scenario
    with (
        sources.active(),
        pytest.raises(ValueError, match=r"^scenario\.id = .*: is (of type|defined in)"),
    ):
        settings.build()
    assert not (tmp_path / "called").exists()
