"""Figures show the names of conditions as they are."""

import io

from nested_agents.studies.presentation.figures import (
    apply_style,
    look,
    marker,
    name_lines,
    name_rows,
    panels,
    spell_dollars,
)

NAMES = ["cost $x_{$", "$5 and $6"]


def test_a_dollar_in_a_name_is_a_character() -> None:
    svg = io.StringIO()
    with apply_style():
        figure, ((axes,),) = panels(1, 1, (3.0, 2.0))
        axes.set(title=NAMES[0], xscale="log", xlim=(1.0, 100.0))
        name_rows(axes, NAMES)
        spell_dollars(figure, NAMES).savefig(svg, format="svg")
    text = svg.getvalue()
    assert all(f">{name}<" in text for name in NAMES)
    assert r">$\mathdefault" not in text  # ticks of logarithms are powers


def test_a_formula_stays_one_where_no_name_has_a_dollar() -> None:
    figure, ((axes,),) = panels(1, 1, (3.0, 2.0))
    axes.set_title(r"$\theta$")
    assert spell_dollars(figure, ["default"]) is figure
    assert axes.title.get_parse_math()


def test_twenty_lines_look_different() -> None:
    assert len({(look(i)["color"], str(look(i)["ls"])) for i in range(20)}) == 20
    assert len({(look(i)["color"], marker(i)) for i in range(20)}) == 20


def test_a_legend_of_many_long_names_leaves_the_panels_their_height() -> None:
    names = [f"condition {i} whose name " + "goes on and on " * 6 for i in range(16)]
    with apply_style():
        figure, ((axes,),) = panels(1, 1, (4.0, 2.5))
        figure.draw_without_rendering()
        before = axes.get_position().height * figure.get_figheight()
        name_lines(figure, names, "title")
        figure.draw_without_rendering()
        (legend,) = figure.legends
        extent = legend.get_window_extent()
    assert extent.x0 >= 0.0
    assert extent.x1 <= figure.bbox.width
    assert axes.get_position().height * figure.get_figheight() > 0.5 * before
    assert legend.get_texts()[0].get_text().count("\n") > 0
