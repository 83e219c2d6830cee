"""A table of estimates for a terminal: no word is broken, whatever its width."""

import io
from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .cells import Row
from .words import count

LABEL = 24
"""What a condition's label may be broken to, if there is no room for all of it [characters]."""


def print_rows(titles: Sequence[str], rows: Sequence[Row], console: Console) -> None:
    """Print estimates by condition, each over its 95 % interval.

    Columns that do not fit side by side without breaking a word follow below, as a further table.
    """
    for block in _blocks(titles, rows, console.width):
        table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style="bold")
        table.add_column("", overflow="fold")
        for i, width in block.items():
            table.add_column(escape(titles[i]), justify="right", overflow="fold", width=width)
        for condition, seeds, cells in rows:
            shown = (cells[i] for i in block)
            table.add_row(
                f"{escape(condition)}\n[dim]{count(seeds, 'seed')}[/]",
                *(f"{c.value}\n[dim]{c.interval or '–'}[/]" if c else "" for c in shown),
            )
        console.print(table)
        console.print()


def text_of(titles: Sequence[str], rows: Sequence[Row], width: int = 80) -> str:
    """Return what `print_rows` prints, without colours."""
    file = io.StringIO()
    print_rows(titles, rows, Console(file=file, width=width, color_system=None))
    lines = file.getvalue().splitlines()
    return "\n".join(line.rstrip() for line in lines).rstrip()


def _blocks(titles: Sequence[str], rows: Sequence[Row], width: int) -> list[dict[int, int]]:
    """Return which columns stand side by side, and how wide each is: in as few blocks as fit.

    Where titles fit in one line there is one block; otherwise they are broken between words.
    """
    label = max(max(len(c), len(count(seeds, "seed"))) for c, seeds, _ in rows)
    texts = [
        [text for _, _, row in rows if (c := row[i]) for text in (c.value, c.interval)]
        for i in range(len(titles))
    ]
    pairs = list(zip(titles, texts, strict=True))
    whole = [max(map(len, [title, *of_cells])) for title, of_cells in pairs]
    if label + sum(1 + wide for wide in whole) <= width:
        return [dict(enumerate(whole))]
    broken = [max(map(len, [*title.split(), *of_cells])) for title, of_cells in pairs]
    n, label = len(broken), min(label, LABEL)
    for many in range(n, 0, -1):
        blocks = [{i: broken[i] for i in range(k, min(k + many, n))} for k in range(0, n, many)]
        if all(label + sum(1 + wide for wide in block.values()) <= width for block in blocks):
            break
    return blocks
