"""Files of scores: names stay text, and malformed rows are refused with their line."""

import json
from pathlib import Path

import pandas as pd
import pytest

from nested_agents.studies.errors import SpecError
from nested_agents.studies.results.score_tables import read_table, table_of

NAMES = [
    "3.1",
    "3.10",
    "0012",
    "12",
    "7e12345",
    "None",
    "NA",
    "nan",
    "true",
    "18446744073709551616",
]


@pytest.mark.parametrize("suffix", [".csv", ".jsonl", ".json"])
def test_names_stay_as_they_are_written(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"names{suffix}"
    rows = [f'{{"name": {json.dumps(name)}}}' for name in NAMES]
    content = {
        ".csv": "\n".join(["name", *NAMES]),
        ".jsonl": "\n".join(rows),
        ".json": f"[{','.join(rows)}]",
    }
    path.write_text("\ufeff" + content[suffix], encoding="utf-8")
    assert read_table(path).text("name").tolist() == NAMES


def test_numbers_of_json_are_names_as_they_are_written(tmp_path: Path) -> None:
    path = tmp_path / "names.jsonl"
    path.write_text('{"name": 3.1}\n{"name": 3.10}\n{"name": 7e12345}\n{"name": null}\n')
    assert read_table(path).text("name").tolist() == ["3.1", "3.10", "7e12345", ""]


def test_only_a_line_feed_ends_a_json_line(tmp_path: Path) -> None:
    path = tmp_path / "lines.jsonl"
    path.write_text('{"a": "1\u20282\u0085"}\r\n\n{"a": "3"}\n', encoding="utf-8")
    table = read_table(path)
    assert table.text("a").tolist() == ["1\u20282\u0085", "3"]
    assert table.places == ["line 1", "line 3"]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "a,b\n1,2\n1,2,3\n", r"line 3: has 3 fields, the header has 2"),
        ("a.csv", "a,b\n1,2\n1\n", r"line 3: has 1 fields, the header has 2"),
        ("a.csv", 'a,b\n"1\n1",2\n1\n', r"line 4: has 1 fields"),
        ("a.csv", 'a,b\n"1,2\n', r"line 2: unexpected end of data"),
        ("a.csv", "a,b,a\n1,2,3\n", r"line 1: column 'a': stands twice"),
        ("a.csv", "a;b\n1;2\n", r"line 1: fields are separated by semicolons, allowed: commas"),
        ("a.csv", "a\tb\n1\t2\n", r"line 1: fields are separated by tabs"),
        ("a.jsonl", '{"a": 1}\n{"a": 1, "a": 2}\n', r"line 2: a: stands twice"),
        ("a.jsonl", '{"a": 1}\n{"a": \n', r"line 2: Expecting value"),
        ("a.jsonl", '{"a": 1}\n[1]\n', r"line 2: must be an object"),
        ("a.json", '[{"a": 1}, 2]', r"must be a list of objects"),
        ("a.parquet", "none", r"holds no table of scores"),
    ],
)
def test_malformed_files_are_refused_with_their_line(
    name: str, text: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(SpecError, match=said) as caught:
        read_table(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_whole_numbers_beside_blank_cells_of_parquet_stay_whole(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow", reason="extra [parquet]")
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "names.parquet"
    seeds = pyarrow.array([2**60, 2**60 + 1, None], pyarrow.int64())
    names = pyarrow.array(["3.10", "0012", None]).dictionary_encode()
    parquet.write_table(pyarrow.table({"seed": seeds, "name": names}), path)
    table = read_table(path)
    assert table.text("seed").tolist() == [str(2**60), str(2**60 + 1), ""]
    assert table.text("name").tolist() == ["3.10", "0012", ""]


def test_names_that_pandas_has_rounded_are_refused() -> None:
    table = table_of(pd.DataFrame({"seed": [2**60, 2**60 + 1, None], "few": [7, None, 8]}))
    with pytest.raises(SpecError, match=r"row 0: seed = 1\.15.*: is a rounded number"):
        table.text("seed")
    assert table.text("few").tolist() == ["7.0", "", "8.0"]
