"""What a message is worth to agents that disagree: the page, and the threshold, by the rows."""

import numpy as np
import pytest

from research import RESULTS, disagreement

NOTEBOOKS = RESULTS.parent / "notebooks"


def test_the_page_has_the_table_that_the_rows_give(tmp_path) -> None:
    every = disagreement.rows()
    page = (NOTEBOOKS / "edges.md").read_text(encoding="utf-8")
    lines = disagreement.lines(every)
    thresholds = lines[-len(every) :]
    assert all(line in page for line in lines[: -len(every) - 1])
    assert all(line.split(": ")[1] in " ".join(page.split()) for line in thresholds)
    disagreement.draw(every).savefig(tmp_path / "figure.png")


def test_the_threshold_is_where_the_line_crosses_zero() -> None:
    errors = [0.0, 0.2, 0.4]
    line = np.tile(np.array(errors)[:, None] - 0.25, (1, 6))
    e = disagreement._threshold(line, errors)
    assert [float(end) for end in e] == pytest.approx([0.25] * 3)
    assert disagreement._brief(e, 0.4) == "0.25 [0.25, 0.25]"
    never = disagreement._threshold(-line, errors)
    assert disagreement._brief(never, 0.4) == "> 0.40 [> 0.40, > 0.40]"
