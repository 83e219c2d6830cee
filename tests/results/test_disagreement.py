"""What a message is worth to agents that disagree: the page, and the threshold, by the rows."""

import numpy as np
import pandas as pd
import pytest

import nested_agents as na
from nested_agents.results import ROWS, disagreement
from nested_agents.studies.results.notation import bracketed

DOCS = ROWS.parents[1] / "docs"


def test_the_page_has_the_table_that_the_rows_give(tmp_path) -> None:
    every = disagreement.rows()
    page = (DOCS / "edges.md").read_text(encoding="utf-8")
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
    assert disagreement._brief(e, 0.4) == ".25 [.25, .25]"
    never = disagreement._threshold(-line, errors)
    assert disagreement._brief(never, 0.4) == "> .4 [> .4, > .4]"


def test_the_table_of_simple_spread_is_that_of_the_rows() -> None:
    rows = pd.read_csv(ROWS / "spread-experience.csv").sort_values("seed")
    page = (DOCS / "peers.md").read_text(encoding="utf-8")
    for condition, own in rows.groupby("condition"):
        cells = [
            bracketed(na.bootstrap(own[own["decisions"] == n]["return"].to_numpy()))
            for n in (1000, 10_000, 100_000, 400_000)
        ]
        assert f"| {condition} | {' | '.join(cells)} |" in page
    last = rows.query("decisions == 400000")
    compared = na.compare_table(last, score="return", seed="seed", reference="random")
    assert [d.p < 0.05 for d in compared.differences] == [True] * 4


ARMS = ((1000, 10_000, 30_000, 100_000, 400_000), 25)
"""After how many decisions teams are evaluated, and by how many episodes."""
BOXES = ((1000, 3000, 10_000, 30_000, 100_000), 10)


@pytest.mark.parametrize(
    ("name", "evaluated", "said"),
    [
        ("arm", ARMS, {400_000: ".01 [0, .02]", 100_000: ".07 [.01, .17]"}),
        ("box", BOXES, {100_000: ".20 [-.03, .39]", 30_000: "-.10 [-.40, .10]"}),
    ],
)
def test_tables_of_success_by_experience_are_those_of_the_rows(name, evaluated, said) -> None:
    rows = pd.read_csv(ROWS / f"{name}-experience.csv").sort_values("seed")
    page = (DOCS / "peers.md").read_text(encoding="utf-8")
    for line in success_lines(rows, *evaluated):
        assert line in page
    wide = rows.pivot(index=["decisions", "seed"], columns="condition", values="success")
    ahead = wide["hierarchy-ppo, chain"] - wide["hierarchy-ppo, no edges"]
    for decisions, text in said.items():
        assert bracketed(na.bootstrap(ahead.loc[decisions].to_numpy())) == text
        assert text in page


def success_lines(rows: pd.DataFrame, evaluated: tuple[int, ...], episodes: int) -> list[str]:
    """Return the rows of a table of shares of so many evaluation episodes."""
    lines = []
    for condition, own in rows.groupby("condition"):
        cells = []
        for n in evaluated:
            shares = own[own["decisions"] == n]["success"].to_numpy()
            solved = np.arange(episodes) < np.rint(episodes * shares)[:, None]
            cells.append(bracketed(na.rate(solved)) if len(shares) else "")
        lines.append(f"| {condition} | {' | '.join(cells)} |")
    return lines
