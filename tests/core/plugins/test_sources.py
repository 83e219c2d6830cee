"""Files of users: what they mean, what is said of bad ones, and how they travel."""

import pickle
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nested_agents.core.plugins import trust
from nested_agents.core.plugins.sources import Sources, active, kept_name

TEXT = "LINKS = 3\n\n\ndef twice(x):\n    return 2 * x\n"


def test_a_name_in_a_file_is_found_and_the_file_run_once(tmp_path: Path) -> None:
    (tmp_path / "arm.py").write_text(TEXT + "class A:\n    class B:\n        pass\n")
    sources = Sources(tmp_path)
    assert sources.load("arm.py:twice")(4) == 8
    assert sources.load("arm.py:A.B") is sources.load("arm.py:A").B
    assert sources.texts == {"arm.py": sources.text("arm.py")}


def test_any_edit_of_a_file_counts() -> None:
    texts = (TEXT, TEXT.replace("3", "4"), "# three\n" + TEXT)
    digests = [Sources(texts={"arm.py": text}).digest("arm.py") for text in texts]
    assert len(set(digests)) == 3


@pytest.mark.parametrize(
    "content", [TEXT.replace("\n", "\r\n").encode(), b"\xef\xbb\xbf" + TEXT.encode()]
)
def test_other_line_ends_and_a_byte_order_mark_change_nothing(
    content: bytes, tmp_path: Path
) -> None:
    (tmp_path / "arm.py").write_bytes(content)
    sources = Sources(tmp_path)
    assert sources.text("arm.py") == TEXT
    assert sources.digest("arm.py") == Sources(texts={"arm.py": TEXT}).digest("arm.py")
    assert sources.load("arm.py:LINKS") == 3


@pytest.mark.parametrize(
    ("text", "reference", "complaint"),
    [
        (TEXT, "leg.py:LINKS", r"^leg\.py: No such file or directory$"),
        (TEXT, "arm.py:Leg", r"^arm\.py has no 'Leg', it has: twice$"),
        (TEXT, "arm.py:", r"^'arm\.py:' must be written path/to/file\.py:name$"),
        ("LINKS = = 3", "arm.py:LINKS", r"^arm\.py cannot be run: SyntaxError: invalid syntax"),
        ("import sys; sys.exit(2)", "arm.py:LINKS", r"^arm\.py cannot be run: SystemExit: 2$"),
        ("import no_such_thing", "arm.py:LINKS", r"ModuleNotFoundError: No module named"),
        ("raise ValueError('two\\nlines')", "arm.py:A", r"ValueError: two lines$"),
    ],
)
def test_a_bad_file_is_told_in_one_line(
    text: str, reference: str, complaint: str, tmp_path: Path
) -> None:
    (tmp_path / "arm.py").write_text(text)
    with pytest.raises(ValueError, match=complaint) as caught:
        Sources(tmp_path).load(reference)
    assert "\n" not in str(caught.value)


def test_what_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "arm.py").write_bytes(b"\xff\xfe")
    (tmp_path / "long.py").write_bytes(b"#" * 1_000_001)
    for name, complaint in (("arm.py", "is not UTF-8 text"), ("long.py", "is larger than allowed")):
        with pytest.raises(ValueError, match=rf"^{name}: {complaint}"):
            Sources(tmp_path).text(name)


def test_texts_travel_without_their_folder(tmp_path: Path) -> None:
    (tmp_path / "arm.py").write_text(TEXT)
    sources = Sources(tmp_path)
    sources.text("arm.py")
    (tmp_path / "leg.py").write_text(TEXT)
    there = pickle.loads(pickle.dumps(sources))
    assert there == sources
    assert there.folder is None
    (tmp_path / "arm.py").write_text("LINKS = 5")
    assert there.load("arm.py:LINKS") == sources.load("arm.py:LINKS") == 3
    with pytest.raises(ValueError, match=r"^leg\.py: is not among the files kept with the study$"):
        there.load("leg.py:LINKS")


def test_names_are_resolved_by_the_active_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "arm.py").write_text("LINKS = 7")
    monkeypatch.chdir(tmp_path)
    with Sources(texts={"arm.py": TEXT}).active():
        assert active().load("arm.py:LINKS") == 3
    assert active().load("arm.py:LINKS") == 7


def test_the_copy_of_a_study_stands_in_for_a_file_that_is_gone(tmp_path: Path) -> None:
    copies = tmp_path / "out" / "sources"
    copies.mkdir(parents=True)
    (copies / "links.py").write_text("LINKS = 3")
    with pytest.raises(
        ValueError, match=r"^links\.py: came with .*out; no spec of yours has run it"
    ):
        Sources(tmp_path, study=tmp_path / "out").load("links.py:LINKS")
    trust.trust("LINKS = 3")
    assert Sources(tmp_path, study=tmp_path / "out").load("links.py:LINKS") == 3
    (tmp_path / "links.py").write_text("LINKS = 4")
    assert Sources(tmp_path, study=tmp_path / "out").load("links.py:LINKS") == 4


@pytest.mark.parametrize("beside", ["shared.py", "shared/__init__.py"])
def test_a_file_that_needs_another_one_is_refused(tmp_path: Path, beside: str) -> None:
    (tmp_path / "links.py").write_text(
        "def links():\n    from shared import LINKS\n    return LINKS"
    )
    Sources(tmp_path).load("links.py:links")  # installed, for all that can be known
    (tmp_path / beside).parent.mkdir(exist_ok=True)
    (tmp_path / beside).write_text("LINKS = 3")
    with pytest.raises(ValueError, match=r"links\.py: imports shared from its folder"):
        Sources(tmp_path).load("links.py:links")


def test_an_installed_module_is_imported_whatever_stands_beside_a_file(tmp_path: Path) -> None:
    (tmp_path / "links.py").write_text("import random, numpy\nLINKS = numpy.pi, random.random")
    for beside in ("random.py", "numpy.py"):
        (tmp_path / beside).write_text("raise ImportError")
    assert Sources(tmp_path).load("links.py:LINKS")[0] > 3


KERNEL = """
from numba import njit


@njit(cache=True)
def double(x):
    return 2 * x
"""


def test_no_compiled_code_beside_a_file_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "kernel.py").write_text(KERNEL)
    assert Sources(tmp_path).load("kernel.py:double")(2) == 4
    assert not (tmp_path / "__pycache__").exists()
    assert list((tmp_path / "cache").rglob("*.nbi"))
    # Kept with a study, the file lies nowhere.
    assert Sources(None, {"other.py": KERNEL}).load("other.py:double")(2) == 4


def test_without_a_folder_to_write_to_nothing_compiled_is_kept_or_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    (tmp_path / "homeless.py").write_text(KERNEL)
    with pytest.raises(ValueError, match="no locator available"):
        Sources(tmp_path).load("homeless.py:double")
    (tmp_path / "homeless.py").write_text(KERNEL.replace("(cache=True)", ""))
    assert Sources(tmp_path).load("homeless.py:double")(2) == 4
    assert not (tmp_path / "__pycache__").exists()


@given(st.lists(st.text("ab_/%\\", min_size=1, max_size=8), min_size=2, max_size=2, unique=True))
def test_copies_of_different_files_have_different_names(names: list[str]) -> None:
    one, other = map(kept_name, names)
    assert one != other
    assert "/" not in one


def test_a_long_path_has_a_copy_of_a_name_that_file_systems_take() -> None:
    names = [kept_name(f"{'folder/' * n}\u00e9arm.py") for n in (10, 60, 61)]
    assert len(set(names)) == 3
    assert all(len(name.encode()) <= 200 and name.endswith("arm.py") for name in names)
    assert names[0].count("folder__") == 10
