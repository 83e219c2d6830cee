"""Writes the archive: the table of every file of published rows, outside sidebar and search."""

from collections.abc import Iterator
from pathlib import Path

from research import RESULTS, load

ABOUT = """---
orphan: true
nosearch: true
---
# Archive of published tables

Each file of `research/results` as `nested-agents table` prints it, without times.
[](../reproduce.md) names the specs.
"""


def write(page: Path) -> None:
    """Write the page, unless it is newer than all rows."""
    files = sorted(RESULTS.glob("*.json"))
    changed = max(path.stat().st_mtime for path in [*files, Path(__file__)])
    if not page.exists() or page.stat().st_mtime < changed:
        page.write_text("\n".join([ABOUT, *sections(files)]), encoding="utf-8")


def sections(files: list[Path]) -> Iterator[str]:
    """Yield a heading and a table for each file of rows."""
    for path in files:
        study = load(path.stem)
        titles = [t for t in study.table().titles if not t.endswith(("[s]", "[ms]"))]
        yield f"## {path.stem}\n\n{study.table(titles).markdown}"
