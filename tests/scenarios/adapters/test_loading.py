"""Environments by registered ids, by modules, and by files of users."""

from __future__ import annotations

import shutil
import sys
import warnings
from pathlib import Path
from typing import Any

import pettingzoo
import pytest
from made_up_environments import Cart, Walkers

from nested_agents.core.plugins import trust
from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios.adapters.settings import GymnasiumSettings, PettingZooSettings
from nested_agents.studies.cli.main import main

HERE = Path(__file__).parent
FILE = "made_up_environments.py"
SPEC = """
preset = "own-value"
seeds = 2
episodes = 1
steps = 4
evaluation = 1

[scenario]
kind = "pettingzoo"
id = "made_up_environments.py:EndsApart"
predictor = "copy"
success = "terminated"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copy(HERE / FILE, tmp_path)
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    return tmp_path


def test_a_file_of_ones_own_is_an_id(folder: Path) -> None:
    with Sources(folder).active():
        players = PettingZooSettings(id=f"{FILE}:Walkers", predictor="copy").build()
        cart = GymnasiumSettings(id=f"{FILE}:Cart", success="terminated").build()
    assert players.agents == Walkers.ids
    assert players.reset(0).shape == (2, 2)
    cart.reset(0)
    ends = [cart.step([1]) for _ in range(10)]
    assert any(end.truncated for end in ends)
    assert [end.info["succeeded"] for end in ends] == [end.terminated for end in ends]


def test_what_a_file_has_now_is_built(folder: Path) -> None:
    settings = PettingZooSettings(id=f"{FILE}:Walkers")
    with Sources(folder).active():
        assert len(settings.build().agents) == 2
    text = (folder / FILE).read_text().replace('("agent_0", "agent_1")', '("a", "b", "c")')
    (folder / FILE).write_text(text)
    with Sources(folder).active():
        assert settings.build().agents == ("a", "b", "c")


def test_a_study_keeps_the_file_and_asks_for_trust(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = folder / "out"
    assert main(["run", str(folder / "spec.toml"), "--out", str(out), "--jobs", "1"]) == 0
    assert (out / "sources" / FILE).exists()
    capsys.readouterr()
    assert main(["results", str(out), "--format", "csv"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 1 + 2
    moved = folder / "elsewhere" / "out"
    shutil.copytree(out, moved)
    monkeypatch.setattr(trust, "_noted", set())
    for name in [name for name in sys.modules if name.startswith("_nested_agents_")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setenv("XDG_STATE_HOME", str(folder / "state"))
    assert main(["explain", str(moved)]) == 2
    assert "--trust runs it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (PettingZooSettings(id=f"{FILE}:Cart"), "is one of scenario.kind = 'gymnasium'"),
        (GymnasiumSettings(id=f"{FILE}:Walkers"), "is one of scenario.kind = 'pettingzoo'"),
        (GymnasiumSettings(id=f"{FILE}:LENGTH"), "is of type int, allowed: environment"),
        (GymnasiumSettings(id=f"{FILE}:Nobody"), f"{FILE} has no 'Nobody'"),
        (GymnasiumSettings(id=FILE), "must be written path/to/file.py:name"),
        (GymnasiumSettings(id="nothing.py:Cart"), "nothing.py: No such file"),
        (
            PettingZooSettings(id="sisl/multiwalker-v0"),
            "is not registered with PettingZoo; did you mean",
        ),
    ],
)
def test_what_cannot_be_made_is_refused_by_its_id(
    folder: Path, settings: Any, message: str
) -> None:
    with pytest.raises(ValueError, match=message) as refused, Sources(folder).active():
        settings.build()
    assert str(refused.value).startswith(f"scenario.id = {settings.id!r}: ")
    assert "\n" not in str(refused.value)


def test_registered_ids_stand_beside_modules() -> None:
    pytest.importorskip("Box2D")
    ids = "sisl/multiwalker-v9", "pettingzoo/sisl/multiwalker_v9", "pettingzoo.sisl.multiwalker_v9"
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        worlds = [PettingZooSettings(id=name).build() for name in ids]
    assert {world.agents for world in worlds} == {worlds[0].agents}
    assert len({world.reset(0).tobytes() for world in worlds}) == 1


def test_an_id_of_ones_own_is_registered_by_the_module_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spec = pettingzoo.EnvSpec("own/walkers-v3", entry_point=Walkers)
    monkeypatch.setitem(pettingzoo.parallel_registry, spec.id, spec)
    assert PettingZooSettings(id="own/walkers-v3").build().agents == Walkers.ids
    with_module = PettingZooSettings(id="made_up_environments:own/walkers-v3")
    assert with_module.build().agents == Walkers.ids


def test_what_success_may_be_is_said() -> None:
    with pytest.raises(ValueError, match=r"success = 'won': must be 'terminated', or must be a t"):
        GymnasiumSettings(id="CartPole-v1", success="won")
    assert GymnasiumSettings(id="CartPole-v1", success="terminated").warnings() == ()
    assert Cart().render_mode is None
