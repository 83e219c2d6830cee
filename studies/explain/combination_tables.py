"""What goes with what, as tables: on a terminal of 80 columns, and on the page of the docs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from textwrap import fill

from ..errors import WIDTH
from .combinations import Combination

MARKS = {"yes": "yes", "left out": "out", "no": "no"}
LEGEND = (
    "yes: runs; out: runs, and what is asked for is left out; no: is refused. The number is that "
    "of the sentence below that says why."
)


def write(cells: Iterable[Combination], *, markdown: bool = False) -> Iterator[str]:
    """Yield the tables, axis by axis, and the sentences, line by line."""
    sentences: dict[str, int] = {}
    for axis, of_axis in groupby(cells, lambda cell: cell.axis):
        tried = list(of_axis)
        rows = [[axis, *dict.fromkeys(cell.case for cell in tried)]]
        for learner, own in groupby(tried, lambda cell: cell.learner):
            rows.append([learner, *(_mark(cell, sentences) for cell in own)])
        yield from _markdown(rows) if markdown else _columns(rows)
        yield ""
    yield LEGEND if markdown else fill(LEGEND, WIDTH)
    yield ""
    for sentence, number in sentences.items():
        line = f"{number}. {sentence}"
        yield line if markdown else fill(line, WIDTH, subsequent_indent="    ")


def _mark(cell: Combination, sentences: dict[str, int]) -> str:
    """Return what stands in a cell; its sentence is numbered, once for all learners alike."""
    verdict, sentence = cell.outcome
    if not sentence:
        return verdict
    anybody = sentence.replace(f"learner.kind = {cell.learner!r}", "learner.kind = ...")
    return f"{MARKS[verdict]} {sentences.setdefault(anybody, len(sentences) + 1)}"


def _columns(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        padded = [cell.ljust(width) for cell, width in zip(row, widths, strict=True)]
        yield "  ".join(padded).rstrip()


def _markdown(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    head, *body = rows
    yield f"| {' | '.join(head)} |"
    yield "|---" * len(head) + "|"
    for row in body:
        yield f"| {' | '.join(row)} |"
