"""Pictures: everything is on them, and nothing on top of another."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.textpath import TextPath

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.topologies import build, parse
from nested_agents.topologies.drawing import ACROSS, DOWN, HEIGHT, WIDTH, draw, picture, positions

TEXTS = ("chain", "tree:2", "star", "teams", "teams:star", "independent", "random:3")


def hierarchy_of(text: str, n: int) -> tuple[Hierarchy, tuple[tuple[int, int], ...]]:
    groups = tuple((i, i + 1) for i in range(0, n, 2))
    agents = [f"robot{i // 2 + 1}.{('left', 'right')[i % 2]}" for i in range(n)]
    return build(parse(text), agents, groups), groups


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("n", [2, 8, 32])
def test_agents_keep_apart(text: str, n: int) -> None:
    places = positions(hierarchy_of(text, n)[0])
    apart = np.abs(places[:, None] - places[None])
    beside = apart[..., 0] >= ACROSS - 1e-9
    below = apart[..., 1] >= DOWN - 1e-9
    assert WIDTH < ACROSS
    assert HEIGHT < DOWN
    assert (beside | below | np.eye(n, dtype=bool)).all()


@pytest.mark.parametrize("text", TEXTS)
def test_a_picture_of_32_agents_names_all_and_fits_a_page(text: str, tmp_path: Path) -> None:
    hierarchy, groups = hierarchy_of(text, 32)
    path = tmp_path / "picture.svg"
    draw(hierarchy, path, bodies=groups, title=text)
    root = ElementTree.parse(path).getroot()
    words = {"".join(element.itertext()).strip() for element in root.iter() if
             element.tag.endswith("text")}  # fmt: skip
    assert set(hierarchy.agents) <= words
    assert text in words
    width, height = (float(root.attrib[side].removesuffix("pt")) / 72 for side in
                     ("width", "height"))  # fmt: skip
    assert width < 12
    assert height < 16


def test_a_title_is_as_wide_as_the_picture_at_most(tmp_path: Path) -> None:
    hierarchy, groups = hierarchy_of("independent", 4)
    title = "evenodd.py:even_odd: 8 agents, depth 2, 4,112 joint actions a step (exhaustive)"
    draw(hierarchy, tmp_path / "picture.svg", bodies=groups, title=title)
    width = float(ElementTree.parse(tmp_path / "picture.svg").getroot().attrib["width"][:-2])
    drawn = TextPath((0, 0), title, size=10).get_extents().width
    assert drawn < width


def test_long_names_are_as_large_as_others_and_stay_in_their_box() -> None:
    names = ["a", "$x$ and $y$", "junction-north-12.phase4", "x" * 200]
    figure = picture(Hierarchy(names, []))
    shown = [text for text in figure.axes[0].texts if not text.get_text().isdigit()]
    assert {text.get_fontsize() for text in shown if text.get_text()} == {8.0}
    assert "$x$ and $y$" in {text.get_text() for text in shown if not text.get_parse_math()}
    for text in shown:
        if text.get_text()[:1] in "ajx$":
            assert text.get_window_extent().width / figure.dpi < WIDTH - 0.2


def test_edges_lead_right_unless_the_picture_folds() -> None:
    places = positions(hierarchy_of("tree:2", 8)[0])
    for a, b in hierarchy_of("tree:2", 8)[0].edges:
        assert places[a, 0] < places[b, 0]


def test_equal_hierarchies_give_equal_files(tmp_path: Path) -> None:
    hierarchy, _ = hierarchy_of("teams", 4)
    draw(hierarchy, tmp_path / "one.svg")
    draw(hierarchy, tmp_path / "two.svg")
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


def test_other_formats(tmp_path: Path) -> None:
    draw(hierarchy_of("chain", 4)[0], tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match=r"suffix must be \.svg, \.png or \.pdf"):
        draw(hierarchy_of("chain", 4)[0], tmp_path / "picture.jpg")
