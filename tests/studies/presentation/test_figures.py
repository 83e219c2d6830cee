"""Figures show the names of conditions as they are."""

import io

from nested_agents.studies.presentation.figures import apply_style, name_rows, panels, spell_dollars

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
