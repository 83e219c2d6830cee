import re

import pytest
from matplotlib.figure import Figure

from nested_agents.studies.report.pictures import pictures


def line():
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], "o-")
    axes.set_title("a < b & c")
    return figure


def test_a_figure_stands_in_a_page_and_can_be_taken_away():
    (picture,) = pictures({"one-line": line()})
    assert (picture["name"], picture["title"]) == ("one-line", "one line")
    assert picture["svg"].startswith('<svg id="figure1-"')
    assert "a &lt; b &amp; c" in picture["svg"]
    assert "<metadata>" not in picture["svg"]
    assert picture["pdf"].startswith("JVBERi")  # %PDF-


def test_a_panel_on_its_own_keeps_the_axis_that_it_shares_with_its_row():
    figure = Figure(layout="constrained")
    (left, _), (_, spare) = figure.subplots(2, 2, sharey=True)
    left.set_ylabel("success")
    spare.set_visible(False)
    (picture,) = pictures({"row": figure})
    parts = [panel["parts"] for panel in picture["panels"]]
    assert [len(own) for own in parts] == [1, 2, 1], "the first of each row has its axis"
    x, _, width, _ = (float(value) for value in parts[1][0][1].split())
    label = left.yaxis.label.get_window_extent()
    scale = 72.0 / figure.dpi
    assert x <= scale * label.x0 <= scale * label.x1 <= x + width
    assert parts[1][1][0] == pytest.approx(width, abs=0.1), "side by side"


def test_equal_figures_are_equal_bytes():
    assert pictures({"line": line()}) == pictures({"line": line()})


def test_ids_of_two_figures_do_not_clash():
    found = [picture["svg"] for picture in pictures({"one": line(), "two": line()})]
    ids = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in found]
    assert not ids[0] & ids[1]
    used = set(re.findall(r'(?:url\(|href=")#([^")]+)', found[0]))
    assert used
    assert used <= ids[0]
