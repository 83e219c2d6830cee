"""Laws of growth of published studies, by Python and by the command."""

import numpy as np
import pytest

import nested_agents as na
from nested_agents.core.interface.measures import SUCCESS
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.growth import growth_figures
from nested_agents.studies.results.results import from_arrays
from nested_agents.studies.results.scaling_law import scaling_law
from research import RESULTS

SIZES = (2, 4, 8)


def made_up(rates, seeds=6, episodes=12, sizes=SIZES):
    """Return results of two topologies whose teams learn after as many episodes as `rates` say."""
    training, columns = {}, {}
    for topology, factor in rates.items():
        for n in sizes:
            label = f"{topology}, robots={n}"
            columns[label] = {"topology": topology, "scenario.robots": n}
            begins = [min(episodes, round(factor * n**0.5) + seed % 2) for seed in range(seeds)]
            success = np.array([np.arange(episodes) >= begin for begin in begins])
            training[label] = {"success": success, "steps": np.full((seeds, episodes), 10 * n)}
    of_seeds = {c: range(seeds) for c in columns}
    return from_arrays({"training": training}, of_seeds, {}, {}, columns, (SUCCESS,))


def test_decisions_to_a_criterion_are_counted_and_fitted() -> None:
    law = scaling_law(made_up({"chain": 1.0, "star": 2.0}), "success", criterion=1.0)
    assert law.title == "decisions to 1 of success"
    assert [fitted.group for fitted in law.fits] == ["chain", "star"]
    chain = law.fits[0].law
    assert chain is not None
    # Seeds 0 and 1 of two robots begin after 1 and 2 episodes; five more are looked at.
    assert np.exp(chain.sample.values[:2, 0]) == pytest.approx([20 * 6, 20 * 7])
    assert any(line.startswith("Exponents, less that of chain") for line in law.notes)


def test_runs_that_never_reach_it_are_censored() -> None:
    law = scaling_law(made_up({"chain": 3.0}), "success", criterion=1.0)
    assert 0 < law.fits[0].censored < 18
    assert "runs censored" in " ".join(law.notes)
    never = scaling_law(made_up({"chain": 30.0}), "success", criterion=1.0)
    assert not never.table
    assert "no law: no run reached the criterion: all are censored" in " ".join(never.notes)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"size": "boxes"}, "size = 'boxes'"),
        ({"criterion": 2.0}, "criterion = 2.0: must be above 0 and at most 1"),
        ({"measure": "speed"}, "measure = 'speed'"),
        ({"measure": "steps", "criterion": 0.5}, "a rate has a criterion"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(options, said) -> None:
    with pytest.raises(SpecError, match=said) as caught:
        scaling_law(made_up({"chain": 1.0}), **{"measure": "success", **options})
    assert "\n" not in str(caught.value)


def test_two_sizes_or_one_seed_give_no_number() -> None:
    two = scaling_law(made_up({"chain": 1.0}, sizes=(2, 4)), "success", criterion=1.0)
    assert not two.table
    assert "2 sizes and 6 seeds" in " ".join(two.notes)
    # Two robots take 120 or 140 decisions, by seed, four 280 or 320.
    assert "less the smaller: 170 [158, 182]" in " ".join(two.notes)
    one = scaling_law(made_up({"chain": 1.0}, seeds=1), "success", criterion=1.0)
    assert "3 sizes and 1 seed" in " ".join(one.notes)


def test_equal_values_are_no_law() -> None:
    never = scaling_law(made_up({"chain": 30.0}), "success")
    assert not never.table
    assert "no law: every run has 0" in " ".join(never.notes)


def test_seeds_that_agree_do_not_make_a_law_certain() -> None:
    law = scaling_law(made_up({"chain": 1.0}), "steps")
    assert "all seeds agree, so that intervals" in " ".join(" ".join(law.notes).split())


def test_figures_of_a_report_are_of_measures_with_a_law() -> None:
    results = made_up({"chain": 3.0, "star": 5.0})
    assert list(growth_figures(results)) == ["growth of success"]
    assert growth_figures(made_up({"chain": 3.0}, sizes=(2, 4))) == {}


def test_the_published_study_of_scaling_by_command_and_in_python(capsys, tmp_path) -> None:
    file = RESULTS / "scaling.json"
    figure = tmp_path / "law.svg"
    command = ["fit", str(file), "--criterion", "0.8", "--predict", "32", "--plot", str(figure)]
    assert main(command) == 0
    out = capsys.readouterr().out
    assert out.startswith("decisions to 0.80 of success")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "<svg" in figure.read_text()
    growth = na.scaling_law(na.load(file), criterion=0.8, predict=[32])
    assert growth.table.titles == ("exponent", "at 32 (90%)")
    assert str(growth.table).splitlines()[1].split()[1] in out
    assert main([*command[:2], "--format", "csv"]) == 0
    assert capsys.readouterr().out.startswith("condition,")
