"""Drawn tables of scores: no verdict depends on the order of rows or columns, no names merge."""

import csv
import io
import random
import re

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import nested_agents as na
from nested_agents.studies.errors import SpecError

NAMES = st.sampled_from(
    [
        *("a", "A", "a ", "b", "a,b", 'a"b', "a\nb", "a\u2028", "=1+1", "\u00e9", "e\u0301"),
        *("3.1", "3.10", "3.100", "0012", "12", "012", "1e3", "1000", "7e12345", "1", "1.0"),
        *("-0", "0", "12345678901234567890", "12345678901234567891"),
        *("None", "NA", "nan", "null", "inf", "true", "True"),
    ]
)
SCORES = st.one_of(
    st.integers(-5, 5).map(str),
    st.floats(-9, 9).map(lambda v: repr(round(v, 3))),
    st.sampled_from(["1e2", "+.5", "-3.", "true", "False", " 2 "]),
)
FAULTS = st.sampled_from(
    [
        *("", "", "", "", "blank score", "comma", "no number", "twice", "field more"),
        *("field less", "blank seed", "blank condition"),
    ]
)
SEED = st.integers(0, 2**32 - 1)


def written(header: list[str], rows: list[list[str]], *, mark: bool = False) -> str:
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows([header, *rows])
    return "\ufeff" * mark + file.getvalue()


@st.composite
def tables(draw: st.DrawFn) -> tuple[list[str], list[list[str]], list[str]]:
    """Draw the header, the rows and the conditions of a table, with runs and items missing."""
    conditions = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    runs = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    items = draw(st.lists(NAMES, min_size=1, max_size=3, unique=True))
    has_seed, has_item = draw(st.booleans()), draw(st.booleans())
    rows = [
        [c, *[r] * has_seed, *[i] * has_item, draw(SCORES)]
        for c in conditions
        for r in (runs if has_seed or not has_item else runs[:1])
        for i in (items if has_item else items[:1])
        if draw(st.integers(0, 9)) > 0
    ]
    header = ["condition", *["seed"] * has_seed, *["item"] * has_item, "score"]
    return header, rows, sorted({row[0] for row in rows})


def spoiled(header: list[str], rows: list[list[str]], fault: str) -> list[list[str]]:
    """Return rows of which the last has a fault."""
    *others, last = [list(row) for row in rows]
    match fault:
        case "blank score":
            last[-1] = ""
        case "comma":
            last[-1] = "0,5"
        case "no number":
            last[-1] = "n/a"
        case "twice":
            others.append(list(last))
        case "field more":
            last.append("1")
        case "field less":
            last.pop()
        case "blank seed":
            last[len(last) - 2] = "" if len(header) > 2 else last[len(last) - 2]
        case "blank condition":
            last[0] = " "
    return [*others, last]


def verdict(path, text: str) -> tuple[str, object]:
    """Return what is said of a table, or its refusal without the line."""
    path.write_bytes(text.encode())
    try:
        comparison = na.compare_table(path)
    except SpecError as error:
        return re.sub(r"line \d+", "line", str(error)), None
    return str(comparison), comparison


@settings(max_examples=60, deadline=None)
@given(tables(), FAULTS, st.booleans(), SEED)
def test_order_does_not_matter_and_names_never_merge(
    tmp_path_factory, table, fault, mark, seed
) -> None:
    header, rows, conditions = table
    path = tmp_path_factory.mktemp("fuzz") / "scores.csv"
    rows = spoiled(header, rows, fault) if rows else rows
    said, comparison = verdict(path, written(header, rows, mark=mark))
    assert comparison is not None or "\n" not in said
    if fault in ("comma", "no number", "field more", "field less") and rows:
        assert comparison is None
    if fault == "twice" and rows and len(header) > 2:
        assert comparison is None
        assert "stands in" in said or "must be a number" in said  # a row has both faults
    if comparison is not None:
        groups = comparison.analysis.groups
        known = conditions if fault != "blank score" else None
        names = sorted(name for group in groups for name in group.values)
        assert known is None or names == known
        for group in groups:
            for name, values in group.values.items():
                own = [row for row in rows if row[0] == name and row[-1].strip()]
                units = {tuple(row[1:2]) if len(header) > 2 else id(row) for row in own}
                assert len(values) == len(units)
                assert np.isfinite(values).all()
    if fault in ("field more", "field less"):
        return  # a row that does not match the header has no columns to be ordered by
    shuffle = random.Random(seed)
    order = shuffle.sample(range(len(header)), len(header))
    other = [[row[k] for k in order] for row in shuffle.sample(rows, len(rows))]
    again, same = verdict(path, written([header[k] for k in order], other))
    assert (same is None) == (comparison is None)
    if comparison is not None:
        assert again == said
