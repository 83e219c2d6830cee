"""A hierarchy in a notebook."""

from xml.etree import ElementTree

import pytest

from nested_agents.core.hierarchy.hierarchy import Hierarchy

SVG = "{http://www.w3.org/2000/svg}"


def parts(hierarchy: Hierarchy, tag: str) -> list[ElementTree.Element]:
    return ElementTree.fromstring(hierarchy._repr_svg_()).findall(SVG + tag)


def test_superiors_stand_above() -> None:
    tree = Hierarchy("abcd", [("a", "b"), ("a", "c"), ("c", "d")])
    rows = {text.text: float(text.get("y", "")) for text in parts(tree, "text")}
    assert rows["a"] < rows["b"] == rows["c"] < rows["d"]
    assert len(parts(tree, "line")) == 3
    assert len(parts(tree, "rect")) == 4


def test_neighbours_are_dashed_and_names_are_escaped() -> None:
    beside = Hierarchy(
        ["<a>", "a & b, a name that is long"], [], [("<a>", "a & b, a name that is long")]
    )
    (line,) = parts(beside, "line")
    assert line.get("stroke-dasharray") == "3"
    assert [text.text for text in parts(beside, "text")] == ["<a>", "a & b, a name…"]


@pytest.mark.parametrize("n", [33, 2000])
def test_of_many_agents_the_number_is_said(n: int) -> None:
    many = Hierarchy([f"a{i}" for i in range(n)], [])
    (text,) = parts(many, "text")
    assert text.text == f"{n} agents, 0 edges, depth 1"
