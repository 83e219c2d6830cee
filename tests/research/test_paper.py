"""The draft of the paper: what it says is what the committed rows say."""

import re
import sys
from pathlib import Path

PAPER = Path(__file__).resolve().parents[2] / "research" / "paper"
TEMPLATE = (PAPER / "template.md").read_text(encoding="utf-8")


def test_the_paper_is_built_of_committed_rows(monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(PAPER))
    from build import build

    sys.modules.pop("build")
    assert build() == (PAPER / "paper.md").read_text(encoding="utf-8"), "build.py"


def test_no_number_is_written_by_hand() -> None:
    text = TEMPLATE.split("---", 2)[2]
    text = re.sub(r"\{\{.*?\}\}|\{%.*?%\}|\[?@[\w; @\n]+\]?|\.?95%", "", text, flags=re.DOTALL)
    assert re.findall(r".*(?<![A-Za-z])\d.*", text) == []


def test_every_source_is_in_the_bibliography() -> None:
    listed = re.findall(r"^@\w+\{(\w+),", (PAPER / "paper.bib").read_text(), re.MULTILINE)
    assert sorted(set(re.findall(r"@(\w+)", TEMPLATE))) == sorted(listed)


def test_it_has_the_parts_of_a_paper_of_joss() -> None:
    assert re.findall(r"^# (.+)$", TEMPLATE, re.MULTILINE)[:2] == ["Summary", "Statement of need"]
