"""Rows remember the code that computed them; an edit of it is told, and mixed only if asked for."""

import sqlite3
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import made_up
import pytest

from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec import outline
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.workers.runner import save

MODULES = {"arms/team.py": "N = 3  # agents", "core/loop.py": "def loop(): pass"}


def test_all_that_computes_is_known_and_pictures_are_not() -> None:
    known = outline.modules()
    assert {"core/agents/team.py", "scenarios/box_pushing/states/variables.py"} <= known.keys()
    assert not [name for name in known if "pictures" in name or name.endswith("figure.py")]
    here = outline.present({}, {})
    assert outline.changed(here, outline.present({}, {})) == []


def test_any_edit_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outline, "modules", lambda: MODULES)
    known = outline.present({}, {})
    later = {**MODULES, "core/loop.py": "def loop(): pass  # runs"}
    monkeypatch.setattr(outline, "modules", lambda: later)
    assert outline.changed(known, outline.present({}, {})) == ["core/loop.py"]


def test_packages_that_offer_things_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "offering"
    package.mkdir()
    (package / "__init__.py").write_text("def arms(agents, groups): return []")
    (tmp_path / "offering-1.dist-info").mkdir()
    (tmp_path / "offering-1.dist-info" / "METADATA").write_text("Name: offering\nVersion: 1\n")
    points = "[nested_agents.topologies]\narms = offering:arms\n[other]\nx = json:loads\n"
    (tmp_path / "offering-1.dist-info" / "entry_points.txt").write_text(points)
    assert "offering/__init__.py" not in outline.modules()
    monkeypatch.syspath_prepend(tmp_path)
    assert "offering/__init__.py" in outline.modules()
    assert not [name for name in outline.modules() if name.startswith("json")]


def test_rows_of_two_codes_are_mixed_only_if_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def kept(text: str, number: int, *, accept_code: bool = False) -> None:
        monkeypatch.setattr(outline, "modules", lambda: {"core/team.py": text})
        with made_up.opened(tmp_path / "study", accept_code=accept_code) as store:
            for trial in pending(store, made_up.TRIALS)[:number]:
                save(store, trial, made_up.measure(trial), 0.0)

    kept("N = 3", 1)
    kept("N = 3", 1)
    with pytest.raises(SpecError, match=r"core/team\.py has changed since .*--accept-code"):
        kept("N = 4", 1)
    kept("N = 4", 1, accept_code=True)
    kept("N = 4", 0)
    with closing(sqlite3.connect(tmp_path / "study" / "results.sqlite")) as db:
        codes = [found for (found,) in db.execute("SELECT code FROM trials WHERE state = 'done'")]
    assert len(codes) == 3
    assert len(set(codes)) == 2


def test_changed_modules_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    old = {"core/a.py": "0", "studies/trials/b.py": "2", "plugin/c.py": "4"}
    here = {"core/d.py": "6", "plugin/c.py": "4"}
    monkeypatch.setattr(outline, "present", lambda *_: here)
    store = SimpleNamespace(
        is_older=False, code=lambda: old, spec=dict, sources=dict, directory="out"
    )
    assert "core/a.py and 2 more have changed" in outline.outdated(store)
