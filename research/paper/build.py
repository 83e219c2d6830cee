"""Writes ``paper.md`` from ``template.md``: every number is read from committed rows.

``python research/paper/build.py`` writes it; ``tests/research/test_paper.py`` checks that it is up
to date. In the template a number is named by the file of its rows, its condition and its column,
as `nested-agents table` prints them: ``{{ cell("scaling", "2", "evaluation success") }}``.
"""

from collections import Counter
from functools import cache
from pathlib import Path

import jinja2

import nested_agents as na
from nested_agents import Summary
from nested_agents.analysis import format_estimate, format_number
from research import claims, load, push_n
from research.studies.chain_order import order_tests

FOLDER = Path(__file__).parent


@cache
def rows(name: str) -> na.StudyResults:
    """Return the committed results of a name."""
    return load(name)


def cell(name: str, condition: str, column: str) -> str:
    """Return an estimate with its 95% interval, as the table of its study has it."""
    return format_estimate(_lines(name)[condition].estimates[column])


def value(name: str, condition: str, column: str) -> str:
    """Return an estimate without its interval."""
    return cell(name, condition, column).partition(" ")[0]


def seeds(name: str, condition: str) -> int:
    """Return the number of seeds of a condition."""
    return _lines(name)[condition].seeds


@cache
def _lines(name: str) -> dict[str, Summary]:
    """Return the lines of the table of a study by condition."""
    return {line.condition: line for line in rows(name).analysis.table}


@cache
def entries() -> dict[str, Summary]:
    """Return the success of the entries of push-n by their names."""
    table = push_n.table_of(push_n.committed_entries(), "success")
    return {line.condition: line for line in table}


def entry(name: str, robots: int) -> str:
    """Return the success of an entry of push-n with so many robots; a dash if it has not run."""
    estimate = entries()[name].estimates.get(f"{robots} robots")
    return "--" if estimate is None else format_estimate(estimate)


def orders() -> dict[str, str]:
    """Return what is tested of all orders of a chain: their number, seeds, and p by measure."""
    tests = order_tests(rows("chain-order").results)
    return {"orders": str(tests[0].orders), "seeds": str(tests[0].seeds)} | {
        f"p{k}": format_number(test.p) for k, test in enumerate(tests)
    }


def verdicts() -> Counter[str]:
    """Return how many claims of the paper have each verdict."""
    findings = claims.judge(claims.committed(claims.OWN))
    return Counter(finding.verdict for finding in findings)


def build() -> str:
    """Return the paper."""
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, keep_trailing_newline=True)
    template = environment.from_string((FOLDER / "template.md").read_text(encoding="utf-8"))
    made = (cell, value, seeds, entry)
    return template.render(
        {function.__name__: function for function in made},
        orders=orders(), verdicts=verdicts(), sizes=push_n.SIZES,
    )  # fmt: skip


if __name__ == "__main__":
    (FOLDER / "paper.md").write_text(build(), encoding="utf-8")
