import re

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
    assert (picture.name, picture.title) == ("one-line", "one line")
    assert picture.svg.startswith('<svg id="figure1-"')
    assert "a &lt; b &amp; c" in picture.svg
    assert "<metadata>" not in picture.svg
    assert picture.pdf.startswith("JVBERi")  # %PDF-


def test_equal_figures_are_equal_bytes():
    assert pictures({"line": line()}) == pictures({"line": line()})


def test_ids_of_two_figures_do_not_clash():
    found = [picture.svg for picture in pictures({"one": line(), "two": line()})]
    ids = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in found]
    assert not ids[0] & ids[1]
    used = set(re.findall(r'(?:url\(|href=")#([^")]+)', found[0]))
    assert used
    assert used <= ids[0]
