"""Numbers of the documentation: times stand in one place, estimates within their intervals."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
GENERATED = ("docs/reference/", "docs/gallery/", "docs/_build/", "docs/notebooks/")
FILES = (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "research").rglob("*.md"))
PAGES = {
    page: re.sub(
        r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    for path in FILES
    if not (page := path.relative_to(ROOT).as_posix()).startswith(GENERATED)
}
"""The pages that people write, without what is printed or typed."""
NUMBER = r"[-+]?[\d,]*\.?\d+"
ESTIMATE = re.compile(rf"(?<![\w.,])({NUMBER})\s\[({NUMBER}),\s({NUMBER})\]")
TIME = re.compile(
    rf"{NUMBER} ?(?:ms|us|µs)\b|{NUMBER} (?:s|min|minutes) of a core|{NUMBER} decisions a second"
)
GIVEN = {"64 ms", "1 ms", "10 ms"}
"""Times that nobody measured: the control period, and what a message is taken to take."""

REPEATING = (
    "README.md",
    "docs/concepts.md",
    "research/notebooks/claims.md",
    *(page for page in PAGES if page.startswith("docs/results/")),
)
"""Pages that repeat what stands elsewhere."""


def estimates(text: str) -> set[tuple[float, float, float]]:
    """Return the estimates of a text with their bounds."""
    cells = (found.groups() for found in ESTIMATE.finditer(text))
    return {(float(v), float(low), float(high)) for v, low, high in map(plain, cells)}


def plain(cells: tuple[str, ...]) -> Iterator[str]:
    return (cell.replace(",", "") for cell in cells)


def test_times_of_decisions_stand_in_benchmarks_alone() -> None:
    measured = {
        (page, time)
        for page, text in PAGES.items()
        if page not in ("docs/benchmarks.md", "research/notebooks/performance.md")
        for time in TIME.findall(text)
        if time not in GIVEN
    }
    assert measured == set(), "say a ratio, or link to docs/benchmarks.md"


@pytest.mark.parametrize("page", PAGES)
def test_an_estimate_lies_within_its_interval(page: str) -> None:
    outside = [one for one in estimates(PAGES[page]) if not one[1] <= one[0] <= one[2]]
    assert outside == []


@pytest.mark.parametrize("page", REPEATING)
def test_an_estimate_that_is_repeated_is_that_of_the_results(page: str) -> None:
    results = set().union(*(estimates(t) for name, t in PAGES.items() if name not in REPEATING))
    results |= {(-value, -high, -low) for value, low, high in results}  # what is lost is not gained
    text = PAGES[page]
    if "claims" in page:  # its table is computed
        text = re.sub(r"^\|.*$", "", text, flags=re.MULTILINE)
    elif "results/" in page:
        results |= estimates(PAGES["research/notebooks/claims.md"])
    assert estimates(text) - results == set()


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith("docs/results/")])
def test_a_page_of_results_has_two_figures_at_most(page: str) -> None:
    assert PAGES[page].count("![") <= 2
