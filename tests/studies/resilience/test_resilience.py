"""Losses of agents: sets and settings, verdicts on made-up results, and kept teams of an arm."""

import json
import re

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.patches import FancyBboxPatch

import nested_agents as na
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.measures import SUCCESS
from nested_agents.core.numerics import pd
from nested_agents.studies.cli.main import main
from nested_agents.studies.resilience.analysis import Resilience, TeamLosses
from nested_agents.studies.resilience.losses import (
    actuator_faults,
    losable_team,
    loss_sets,
    positions,
    with_loss,
)
from nested_agents.studies.resilience.report import ResilienceReport
from nested_agents.studies.spec.conditions import ConditionSettings

ARM = """
study = "hierarchies"
seeds = 3
episodes = 1
steps = 80
evaluation = 2
keep_teams = true
preset = "hand-written"
scenario.kind = "kinematic-chain"
scenario.joints = 3
sweep.topology = ["chain", "independent"]
"""
CHAIN = (Hierarchy("abc", [("a", "b"), ("b", "c")]), tuple("abc"), (0, 1, 2))


def settings_of(**table):
    return ConditionSettings.model_validate(table)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.toml").write_text(ARM)
    assert main(["run", str(folder / "arm.toml"), "--out", str(folder / "out"), "--jobs", "1"]) == 0
    return folder / "out"


def rates(*by_seed):
    """Success of 10 episodes by the number of successes of each seed."""
    return pd.DataFrame([[1.0] * n + [0.0] * (10 - n) for n in by_seed])


def resilience(lost, intact=(10,) * 12):
    own = TeamLosses("chain", *CHAIN, rates(*intact), {k: rates(*v) for k, v in lost.items()})
    return Resilience("absent", SUCCESS, "success", 0.1, (own,)), own


def test_all_single_losses_and_some_of_many_larger_sets_are_chosen():
    assert loss_sets(64, 1, max_sets=20) == [(i,) for i in range(64)]
    drawn = loss_sets(64, 3, max_sets=20)
    assert len(set(drawn)) == 20
    assert all(len(set(units)) == 3 for units in drawn)
    assert loss_sets(64, 3, max_sets=20) == drawn, "the same for all seeds and runs"


def test_positions_are_those_in_the_hierarchy():
    assert positions(CHAIN[0]) == ("root", "middle", "leaf")
    assert positions(Hierarchy("ab", [])) == ("alone", "alone")


def test_wheels_of_a_robot_belong_to_its_agent():
    settings = settings_of(agents="body")
    assert losable_team(settings, "absent")[1] == ("robot1", "robot2")
    _, wheels, agents = losable_team(settings, "seized")
    assert wheels == ("robot1.left", "robot1.right", "robot2.left", "robot2.right")
    assert agents == (0, 0, 1, 1)


def test_a_loss_is_added_to_the_failures_of_the_settings():
    settings = settings_of(topology={"kind": "chain", "failures": [
        {"kind": "lost", "agents": ["robot2.left"]}]})  # fmt: skip
    lost = with_loss(settings, "absent", ["robot1.left"]).topology.failures
    assert [(f.kind, f.agents) for f in lost] == [
        ("lost", ("robot2.left",)), ("absent", ("robot1.left",)),
    ]  # fmt: skip
    (seized,) = with_loss(settings, "seized", ["robot1.left"]).scenario.failures
    assert (seized.kind, seized.wheels, seized.episode, seized.step) == (
        "seized", ("robot1.left",), 0, 0,
    )  # fmt: skip
    assert actuator_faults(settings.scenario)["weak"] == "wheels"


def test_a_team_that_succeeds_without_any_one_agent_tolerates_single_losses():
    analysis, own = resilience({(i,): (10,) * 12 for i in range(3)})
    # Wilson's interval of 12 equal seeds is wide, so that nothing can be said yet.
    assert analysis.verdict(own) == "undecided"
    generous = Resilience("absent", SUCCESS, "success", 0.5, (own,))
    assert generous.verdict(own) == "yes"


def test_one_agent_without_which_the_team_fails_is_enough_for_no():
    analysis, own = resilience({(0,): (1, 2, 1, 0) * 3, (1,): (10,) * 12, (2,): (10,) * 12})
    assert analysis.verdict(own) == "no"
    worst = analysis.worst(own)
    assert worst.condition == "a"
    assert float(worst.estimate.value) == pytest.approx(-0.9)
    assert (
        "the team does not tolerate every single loss. The worst is that of a (root)"
        in " ".join(analysis.sentences)
    )


def test_the_loss_that_leaves_the_verdict_undecided_is_named():
    analysis, own = resilience({(0,): (6, 10) * 6, (1,): (9,) * 12, (2,): (7,) + (10,) * 11})
    changes = {d.condition: d.estimate for d in analysis.single["chain"]}
    assert analysis.verdict(own) == "undecided"
    assert analysis.worst(own).condition == min(changes, key=lambda unit: changes[unit].low)
    assert "The least certain is that of b (middle)" in " ".join(analysis.sentences)


def test_performance_halves_with_the_number_of_losses_at_which_its_mean_is_half():
    single = {(i,): (8, 9) * 6 for i in range(3)}
    pairs = {(0, 1): (4, 6) * 6, (1, 2): (5,) * 12}
    _, own = resilience(single)
    assert own.halving is None
    _, own = resilience(single | pairs)
    assert own.halving == 2


def test_rows_are_by_position_and_number(arm):
    analysis, _ = resilience({(i,): (9, 8) * 6 for i in range(3)} | {(0, 1): (4, 5) * 6})
    assert [line.condition for line in analysis.summaries] == [
        "chain, intact", "chain, 1 lost, root (1)", "chain, 1 lost, middle (1)",
        "chain, 1 lost, leaf (1)", "chain, 2 lost, 1 of 3 sets",
    ]  # fmt: skip
    change = analysis.summaries[1].estimates["change"]
    assert float(change.value) == pytest.approx(-0.15)


def test_kept_teams_are_evaluated_with_losses(arm, tmp_path, capsys):
    assert main(["resilience", str(arm), "--format", "json", "--jobs", "1"]) == 0
    output, progress = capsys.readouterr()
    assert "1 lost: up to 3 evaluations" in progress
    own = json.loads(output)
    chain, other = own["teams"]
    (compared,) = own["comparison"]
    assert (compared["condition"], compared["reference"]) == (other["condition"], "chain")
    assert compared["paired"]
    assert [one["position"] for one in chain["single"]] == ["root", "middle", "leaf"]
    assert chain["intact"]["value"] == pytest.approx(
        na.load(arm).results.means("chain", "evaluation").mean()
    )
    costs = [-one["change"]["value"] for one in chain["single"]]
    assert max(costs) > 0.0, "the base of the arm never moves"
    assert main(["resilience", str(arm), "--fault", "locked", "--out", str(tmp_path / "f")]) == 0
    shown = capsys.readouterr().out
    assert re.search(
        r"the team (tolerates any|does not tolerate every) single loss", " ".join(shown.split())
    )
    assert {path.suffix for path in (tmp_path / "f").iterdir()} == {".png", ".svg"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--fault", "abesnt"], "fault = 'abesnt': did you mean 'absent'"),
        (["--sets", "0"], "sets = 0: must be 1 or more"),
        (["--tolerance", "2"], "tolerance = 2: must be above 0 and below 1"),
        (["--measure", "sucess"], "did you mean 'success'"),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(arguments, message, arm, capsys):
    assert main(["resilience", str(arm), *arguments]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    (line,) = output.err.splitlines()
    assert message in line


def test_one_agent_cannot_be_lost():
    with pytest.raises(na.SpecError, match="one agent only"):
        losable_team(settings_of(agents="team"), "absent")


def test_a_study_without_teams_is_refused(tmp_path, capsys):
    (tmp_path / "arm.toml").write_text(ARM.replace("keep_teams = true", ""))
    out = tmp_path / "out"
    assert main(["run", str(tmp_path / "arm.toml"), "--out", str(out), "--jobs", "1"]) == 0
    capsys.readouterr()
    assert main(["resilience", str(out)]) == 2
    assert "keeps no teams: its spec has no keep_teams = true" in capsys.readouterr().err


def test_seeds_are_paired_whatever_their_order():
    analysis, own = resilience({(0,): (9,) * 12, (1,): (9,) * 12, (2,): (9,) * 12})
    shuffled = own.lost[0,].iloc[np.random.default_rng(0).permutation(12)]
    own.lost[0,] = shuffled
    assert float(analysis.single["chain"][0].estimate.value) == pytest.approx(-0.1)


def compared(lost, reference_lost):
    """Compare an independent team with a chain, by successes of 10 after each single loss."""
    teams = [
        TeamLosses(name, *CHAIN, rates(*(10,) * 12), {(i,): rates(*own) for i in range(3)})
        for name, own in (("chain", reference_lost), ("independent", lost))
    ]
    return Resilience("absent", SUCCESS, "success", 0.1, tuple(teams))


def test_losses_of_hierarchies_are_compared_by_seed():
    analysis = compared((9, 8) * 6, (5, 4, 5, 3, 5, 4) * 2)
    (difference,) = analysis.comparison
    sample = np.array([0.1, 0.2] * 6) - np.array([0.5, 0.6, 0.5, 0.7, 0.5, 0.6] * 2)
    assert difference.sample == pytest.approx(sample)
    assert float(difference.estimate.value) == pytest.approx(sample.mean())
    assert difference.paired
    assert difference.estimate.high < -0.3
    assert difference.p == pytest.approx(2 / 2**12)
    lines = analysis.comparison_lines
    assert lines[0] == "loss in success after any single failure, minus that of chain:"
    assert lines[1].startswith("  better: independent, -0.")


def test_losses_are_paired_by_the_name_of_the_seed():
    analysis = compared((0, 3, 5, 7, 9, 10) * 2, (0, 3, 5, 7, 9, 10) * 2)
    chain, other = analysis.teams
    for units, frame in other.lost.items():
        other.lost[units] = frame.iloc[::-1]
    assert analysis.comparison[0].sample == pytest.approx(np.zeros(12))
    assert chain.loss[3] == other.loss[3]


def test_equal_losses_of_all_seeds_have_an_interval():
    (difference,) = compared((10,) * 12, (10,) * 12).comparison
    value, low, high = map(float, difference.estimate)
    assert value == 0.0
    assert low < 0.0 < high
    assert low == pytest.approx(-high)


def test_one_hierarchy_is_not_compared():
    analysis, _ = resilience({(i,): (9, 8) * 6 for i in range(3)})
    assert analysis.comparison == ()
    assert analysis.comparison_lines == []


def test_names_are_legible_on_the_color_of_every_cost():
    analysis, _ = resilience({(0,): (0,) * 12, (1,): (5,) * 12, (2,): (10,) * 12})
    (axes,) = ResilienceReport(analysis).figures()["chain"].axes
    fills = [box.get_facecolor()[:3] for box in axes.patches if isinstance(box, FancyBboxPatch)]
    inks = [
        to_rgb(next(text for text in axes.texts if text.get_text() == name).get_color())
        for name in "abc"
    ]
    assert fills[0] < fills[1] < fills[2], "darker, the more a loss costs"
    for fill, ink in zip(fills, inks, strict=True):
        assert abs(np.mean(fill) - np.mean(ink)) > 0.3
    assert min(text.get_fontsize() for text in axes.texts) >= 8.0


def test_conditions_that_never_succeed_are_named(tmp_path, capsys):
    names = '[[overrides]]\nname = "far"\ntopology = "star"\nscenario.tolerance = 1e-6\n'
    names += '[[overrides]]\nname = "near"\n'
    spec = ARM.replace('sweep.topology = ["chain", "independent"]\n', names)
    (tmp_path / "arm.toml").write_text(spec)
    folder = tmp_path / "out"
    main(["run", str(tmp_path / "arm.toml"), "--out", str(folder), "--jobs", "1"])
    capsys.readouterr()
    assert main(["resilience", str(folder), "--format", "csv", "--jobs", "1"]) == 0
    table, remark = capsys.readouterr()
    assert "far" not in table
    assert "evaluation success" in remark
    assert "0 or below: far." in remark
    report = na.load(folder).resilience()
    assert "0 or below: far." in " ".join(report.notes)
    assert json.loads(report.json)["left_out"] == ["far"]
