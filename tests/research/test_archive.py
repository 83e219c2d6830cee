"""The archive of published tables: every file of rows has its section, without times."""

import runpy
from pathlib import Path

from research import RESULTS

ARCHIVE = runpy.run_path(str(Path(__file__).resolve().parents[2] / "docs" / "archive.py"))


def test_a_section_has_the_table_without_times() -> None:
    (section,) = ARCHIVE["sections"]([RESULTS / "arms.json"])
    heading, _, columns, *rows = section.splitlines()
    assert heading == "## arms"
    assert "evaluation success" in columns
    assert "[ms]" not in columns
    assert [row.split(" | ")[0] for row in rows[1:]] == [f"| {n} joints" for n in (2, 4, 8, 16)]


def test_a_page_that_is_newer_than_all_rows_stays(tmp_path: Path) -> None:
    page = tmp_path / "archive.md"
    page.write_text("written")
    ARCHIVE["write"](page)
    assert page.read_text() == "written"
