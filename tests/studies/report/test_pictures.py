from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from nested_agents.studies.report.pictures import pictures


def draw(analysis, directory):
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], "o-")
    axes.set_title("a < b & c")
    figure.savefig(directory / "one-line.svg")
    figure.savefig(directory / "one-line.png")
    plt.imsave(directory / "pixels.png", np.zeros((2, 2)))
    (directory / "by_hand.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"></svg>')
    return [directory / n for n in ("one-line.png", "one-line.svg", "pixels.png", "by_hand.svg")]


def test_every_kind_of_figure():
    line, pixels, by_hand = pictures(SimpleNamespace(draw=draw), None)
    assert (line.name, line.title) == ("one-line", "one line")
    assert line.svg.startswith('<svg id="figure1-"')
    assert "a &lt; b &amp; c" in line.svg
    assert "<metadata>" not in line.svg
    assert line.pdf.startswith("JVBERi")  # %PDF-
    assert pixels.svg is None
    assert pixels.png.startswith("iVBOR")  # \x89PNG
    assert (by_hand.svg[:19], by_hand.pdf) == ('<svg id="figure3-" ', "")


def test_equal_figures_are_equal_bytes():
    study = SimpleNamespace(draw=draw)
    assert pictures(study, None) == pictures(study, None)


def test_matplotlib_is_left_as_it_was():
    pictures(SimpleNamespace(draw=draw), None)
    assert get_registered_canvas_class("svg") is FigureCanvasSVG


def test_ids_of_two_figures_do_not_clash():
    import re

    def twice(analysis, directory):
        paths = draw(analysis, directory)
        (directory / "copy.svg").write_text(paths[1].read_text())
        return [*paths, directory / "copy.svg"]

    found = [p.svg for p in pictures(SimpleNamespace(draw=twice), None) if p.svg]
    ids = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in found]
    assert not ids[0] & ids[-1]
    used = set(re.findall(r'(?:url\(|href=")#([^")]+)', found[0]))
    assert used
    assert used <= ids[0]
