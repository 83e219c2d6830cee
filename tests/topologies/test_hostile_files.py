"""Files of graphs that nobody sound of mind would write: one line each, which names the file."""

import os
import random
import re
from pathlib import Path

import pytest

from nested_agents.studies.cli.main import main
from nested_agents.topologies import build, parse
from nested_agents.topologies.view import names_in

GRAPHML = '<graphml xmlns="http://graphml.graphdrawing.org/xmlns"><graph edgedefault="directed">'
HOSTILE = {
    "deep.json": '{"edges": ' + "[" * 100_000 + "]" * 100_000 + "}",
    "deep_nodes.json": '{"nodes": ' + '{"a": ' * 100_000 + "1" + "}" * 100_000 + "}",
    "nodes.json": '{"nodes": ["a", "b"], "edges": []}',
    "null.json": '{"edges": null}',
    "string.json": '{"edges": ["ab", "bc"]}',
    "text.json": '{"edges": "ab"}',
    "number.json": '{"edges": 5}',
    "alone.json": '{"edges": [], "alone": "ab"}',
    "list.json": '["a", "b"]',
    "surrogate.json": '{"edges": [["a", "\\ud800"]]}',
    "escape.json": '{"edges": [["a", "\\u001b[31mred"]]}',
    "newline.json": '{"edges": [["a", "b\\nnested-agents: error: other"]]}',
    "empty_name.json": '{"edges": [["a", ""]]}',
    "nan.json": '{"edges": [["a", NaN]]}',
    "infinite.json": '{"edges": [["a", 1e999]]}',
    "fraction.json": '{"edges": [["a", 0.5]]}',
    "truth.json": '{"edges": [["a", true]]}',
    "digits.json": '{"edges": [["a", ' + "1" * 5000 + "]]}",
    "order.json": '{"kind": "chain", "order": ' + "[" * 900 + "]" * 900 + "}",
    "key.json": '{"' + "k" * 5000 + '": []}',
    "long.json": '{"edges": [["a", "' + "n" * 5000 + '"], ["a", "' + "n" * 5000 + '"]]}',
    "cut.json": '{"edges": [["a"',
    "empty.json": "",
    "target.graphml": GRAPHML + '<node id="a"/><edge source="a"/></graph></graphml>',
    "source.graphml": GRAPHML + '<node id="a"/><edge target="a"/></graph></graphml>',
    "id.graphml": GRAPHML + "<node/></graph></graphml>",
    "name.graphml": GRAPHML + '<node id="a&#10;b"/></graph></graphml>',
    "no.graphml": "<html/>",
    "cut.graphml": GRAPHML,
    "deep.graphml": GRAPHML + "<graph>" * 5000,
}


@pytest.mark.parametrize("name", HOSTILE)
def test_one_line_names_the_file(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text(HOSTILE[name], encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["topology", "show", name]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(r"nested-agents: error: [ -~]{1,1300}\n", error), error
    assert name in error
    assert "has no attribute" not in error


@pytest.mark.parametrize("suffix", [".json", ".toml", ".graphml", ".py:f"])
@pytest.mark.parametrize("what", ["directory", "FIFO", "large", "latin-1", "absent"])
def test_what_is_no_text_is_told_at_once(
    suffix: str, what: str, tmp_path: Path, monkeypatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / f"ring{suffix}".removesuffix(":f")
    if what == "directory":
        path.mkdir()
    elif what == "FIFO":
        os.mkfifo(path)
    elif what == "large":
        path.write_bytes(b"[" * 1_000_001)
    elif what == "latin-1":
        path.write_bytes("# \xe4".encode("latin-1"))
    assert main(["topology", "show", f"ring{suffix}"]) == 2
    error = capsys.readouterr().err
    assert re.fullmatch(r"nested-agents: error: [ -~]{1,1300}\n", error), error
    words = {"large": "is larger than", "latin-1": "is not UTF-8 text", "absent": "No such file"}
    assert words.get(what, "is not a regular file") in error


def test_a_file_that_is_not_there_is_told_so(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["topology", "show", "ring.jsn"]) == 2
    assert "topology 'ring.jsn': no such file; suffix must be" in capsys.readouterr().err
    (tmp_path / "ring.jsn").write_text("{}")
    assert main(["topology", "show", "ring.jsn"]) == 2
    assert "topology 'ring.jsn': suffix must be .graphml" in capsys.readouterr().err


@pytest.mark.parametrize("levels", [99, 100, 900, 2000])
def test_nested_teams_of_many_levels_are_made_or_told(levels, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    members = "".join(f'["a{i}", ' for i in range(levels)) + '["b"]' + "]" * levels
    (tmp_path / "deep.json").write_text(f'{{"members": {members}}}')
    assert main(["topology", "show", "deep.json"]) == (2 if levels > 100 else 0)
    error = capsys.readouterr().err
    assert levels <= 100 or re.fullmatch(r"nested-agents: error: [ -~]{1,1300}\n", error), error


def test_names_in_arguments_are_checked_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["topology", "show", "edges:a>\x1b[31mb"]) == 2
    assert "'\\x1b[31mb' is no name of an agent" in capsys.readouterr().err


@pytest.mark.parametrize("change", ["\r\n", "BOM"])
def test_files_of_other_systems_mean_the_same(
    change: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    texts = {
        "a.json": '{"edges": [\n["a", "b"],\n["b", "c"]]}\n',
        "a.graphml": GRAPHML + '\n<node id="a"/>\n<node id="b"/><node id="c"/>\n'
        '<edge source="a" target="b"/>\n<edge source="b" target="c"/></graph></graphml>\n',
    }
    for name, text in texts.items():
        other = "\ufeff" + text if change == "BOM" else text.replace("\n", change)
        (tmp_path / name).write_bytes(other.encode())
        assert build(name, "abc").edges == ((0, 1), (1, 2))


def test_damaged_files_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rng = random.Random(0)
    sound = {
        "a.json": '{"kind": "teams", "members": [["a", "b"], ["c"]]}',
        "b.json": '{"edges": [["a", "b"], ["b", "c"]], "alone": ["d"]}',
        "c.graphml": GRAPHML + '<node id="a"/><edge source="a" target="b"/></graph></graphml>',
    }
    for name, content in sound.items():
        for _ in range(150):
            data = bytearray(content.encode())
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
            (tmp_path / name).write_bytes(data)
            said = told(name)
            assert said is None or re.fullmatch(f"{name}[^\n]+", said)


def told(name: str) -> str | None:
    """Return why a file is refused; None if it is not."""
    try:
        names_in(parse(name))
    except ValueError as error:
        return str(error).removeprefix(f"topology '{name}': ")
    return None
