import re
import shutil
import sqlite3
from html import unescape
from pathlib import Path

import pytest
from markupsafe import escape as html_escape

from nested_agents import studies
from nested_agents.studies.cli.main import main
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.report.page import page, unfolded
from nested_agents.studies.report.sentences import main_title, methods, verdict
from nested_agents.studies.results.analysis import Analysis, Summary
from nested_agents.studies.results.statistics import Estimate, exactly
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import DATABASE
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.trial import trials_of
from research import SPECS

SIZES = {"seeds": 3, "episodes": 4, "steps": 5, "evaluation": 2}


@pytest.fixture(scope="module")
def finished(kept, tmp_path_factory):
    return kept(tmp_path_factory.mktemp("study") / "here")


@pytest.fixture(scope="module")
def html(finished):
    return page(finished)


def sections(html):
    return re.findall(r'<section id="(\w+)"', html)


def methods_of(html):
    section = html[html.index('<section id="methods">') :].partition("</section>")[0]
    return unescape(section).replace("\xa0", " ")


def test_a_finished_study_has_everything(html):
    assert sections(html) == [
        "summary", "table", "figures", "hierarchy", "replay", "methods", "spec", "versions",
    ]  # fmt: skip
    assert html.count('aria-label="hierarchy: default') == 1
    assert 'aria-label="hierarchy: frozen' not in html, "it is the same"
    assert "All 6 trials are done." in html
    found = dict(re.findall(r"<li>(.*?): evaluation success is (\S+)\s", html))
    assert list(found) == ["default", "frozen"]
    assert all(f"<td>{value}<small>" in html for value in found.values())
    assert "evaluation success, minus that of default:" in html
    assert "preset = [\n    &#34;default&#34;,\n    &#34;frozen&#34;,\n]" in html
    assert len(html) < 500_000


def test_methods_and_each_condition_are_described(html):
    assert "Task: box-pushing with 2 robots." in html
    described = methods_of(html)
    assert "Search over joint actions: auto (exact_up_to = 5" in described
    assert "Failures" not in described
    assert "Means over 3 seeds with 95% intervals. Fewer than 8 seeds: " in described
    assert "paired by seed" in described
    assert "Holm" in described
    assert html.count("<li>default: evaluation success is ") == 1
    assert html.count("<li>frozen: evaluation success is ") == 1
    lead = html[html.index('<p class="lead">') :].partition("</p>")[0]
    assert "Evaluation success is the same with default and frozen, " in lead
    assert "0 of 1 difference is significant" in lead
    assert "Karigiannis" in html


def test_methods_name_failures_their_times_and_their_conditions(kept, tmp_path):
    seized = {"kind": "seized", "wheels": "robot1.front-left", "episode": 2, "end_episode": 3}
    lost = {"kind": "lost", "agents": "*", "probability": 0.5, "episode": 1, "step": 4}
    overrides = [
        {"name": "sound"},
        {"name": "lost", "scenario": {"failures": [seized]}, "topology": {"failures": [lost]}},
    ]
    spec = Spec.of({**SIZES, "overrides": overrides})
    described = methods_of(page(kept(tmp_path, spec, done=0)))
    assert (
        "seized, wheels robot1.front-left, from episode 2 until episode 3 begins (lost)"
        in described
    )
    loss = "lost, agents *, probability 0.5, from step 4 of episode 1 on (lost)"
    assert loss in described


def test_methods_say_what_recovery_is(kept, tmp_path):
    fault = {"kind": "seized", "wheels": "robot1.front-left", "episode": 5}
    table = {
        "study": "wheel-failure",
        "seeds": 2,
        "episodes": 10,
        "scenario": {"failures": [fault]},
    }
    lines = [Summary("a", 2, {"recovered": exactly(1.0)})]
    settings = kept(tmp_path, Spec.of(table), done=0)
    assert "Recovered: " not in methods_of(page(settings)), "no trial has finished"
    with Store.open(settings) as store:
        described = methods(store.settings(), "", tabulate(lines), is_compared=False)
    assert any(sentence.startswith("Recovered: share of seeds") for sentence in described)
    assert not any("Holm" in sentence for sentence in described)


def test_lines_are_joined_to_what_they_continue():
    lines = [
        "success, less than a:",
        "  worse: b, -0.50 [-0.70,",
        "    -0.30]",
        "",
        "p: one",
        "  two",
    ]
    joined = [(0, "success, less than a:"), (2, "worse: b, -0.50 [-0.70, -0.30]"), (0, "")]
    assert unfolded(lines) == [*joined, (0, "p: one two")]


def test_the_lowest_and_the_highest_success_are_a_sentence():
    rates = {"b": 0.9, "a": 0.1, "c": 0.5}
    lines = [Summary(c, 8, {"success": exactly(rate)}) for c, rate in rates.items()]
    table = tabulate(lines)
    nothing = Analysis(())
    assert main_title(table) == "success"
    sentence = "Success is highest with b, 0.90, and lowest with a, 0.10."
    assert verdict(table, "success", nothing) == (sentence,)
    assert verdict(tabulate(lines[:1]), "success", nothing) == ("Success is 0.90.",)
    assert verdict(table, "", nothing) == ()


def test_conditions_of_equal_value_are_named_together():
    def sentence(*values):
        lines = [Summary(f"c{i}", 8, {"success": Estimate(*v)}) for i, v in enumerate(values)]
        return verdict(tabulate(lines), "success", Analysis(()))[0]

    whole, wide, none = (1.0, 0.7, 1.0), (1.0, 0.5, 1.0), (0.0, 0.0, 0.3)
    lowest = "lowest with c0, 0 [0, 0.30]"
    assert sentence(none, whole, whole) == (
        f"Success is highest with c1 and c2, 1.00 [0.70, 1.00], and {lowest}."
    )
    two = sentence(none, whole, wide)
    assert two == f"Success is highest with c1 and c2, 1, and {lowest}.", "intervals differ"
    assert "c1 and c2 and c3 and 2 more, 1.00" in sentence(none, *[whole] * 5)
    assert "highest" not in sentence(whole, whole)


def test_equal_results_give_equal_bytes_wherever_they_are(finished, html, tmp_path):
    copy = shutil.copytree(finished, tmp_path / "elsewhere")
    assert page(copy) == html
    assert str(finished.parent) not in html


def test_it_asks_for_nothing_outside(html):
    html = re.sub(r'xmlns(:\w+)?="[^"]*"', "", html)
    assert re.findall(r"(?:https?:)?//[a-z][\w.]+\.[a-z]+", html) == []
    assert not re.search(r"<(link|iframe|object)\b|\bsrc=\"(?!data:)|@import", html)


def test_damaged_rows_are_not_published(finished, tmp_path, capsys):
    copy = shutil.copytree(finished, tmp_path / "copy")
    (copy / "report.html").unlink(missing_ok=True)  # of another test
    with sqlite3.connect(copy / DATABASE) as connection:
        connection.execute("UPDATE episodes SET success = 1")
    assert main(["report", str(copy)]) == 2
    assert "rows are damaged" in capsys.readouterr().err
    assert not (copy / "report.html").exists()


def test_an_empty_study(kept, tmp_path):
    html = page(kept(tmp_path, done=0))
    assert sections(html) == ["summary", "hierarchy", "methods", "spec", "versions"]
    assert "There is nothing to show yet." in html


def test_an_unfinished_study_with_failures(kept, tmp_path):
    html = page(kept(tmp_path, done=3, failed=2))
    assert "Unfinished: 3 of 6 trials are done, 2 failed, 1 left." in html
    assert html.count("<details>") == 4
    assert "RuntimeError: &lt;off &amp; away&gt;" in html
    assert "…/core/team.py" in html
    assert "someone" not in html


def test_the_command_writes_it_whole(finished, tmp_path, capsys):
    assert main(["report", str(finished)]) == 0
    assert capsys.readouterr().out.startswith(f"{finished / 'report.html'}: 0.")
    assert main(["report", str(finished), "--out", str(tmp_path / "a.html")]) == 0
    assert (tmp_path / "a.html").read_bytes() == (finished / "report.html").read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["a.html"]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["nowhere"], f"nowhere: holds no study (no {DATABASE})"),
        (["STUDY", "--out", "OUT"], "--out OUT: is a directory"),
        (["STUDY", "--out", "OUT/spec.toml"], "--out OUT/spec.toml: suffix must be .html or .htm"),
        (["STUDY", "--out", "OUT/deep/a.html"], "--out OUT/deep/a.html: there is no directory"),
    ],
)
def test_what_the_user_can_mend(arguments, complaint, finished, tmp_path, capsys):
    places = {"STUDY": str(finished), "OUT": str(tmp_path)}

    def placed(text):
        for name, place in places.items():
            text = text.replace(name, place)
        return text

    assert main(["report", *map(placed, arguments)]) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"nested-agents: error: {placed(complaint)}")
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


CATALOGUE = sorted((Path(studies.__file__).parent / "catalogue").rglob("*.toml"), reverse=True)
PATHS = [*CATALOGUE, *sorted(SPECS.rglob("*.toml"), reverse=True)]
ONE_EACH = {path.parent.name: path for path in CATALOGUE}


@pytest.mark.parametrize("path", PATHS, ids=[path.stem for path in PATHS])
def test_every_committed_spec_is_read(path):
    if path.stem in ("swimmer-n", "swimmer-transfer"):
        pytest.importorskip("mujoco", reason="extra [mujoco]")
    assert trials_of(Spec.load(path, ["seeds=1"]))


@pytest.mark.parametrize("path", ONE_EACH.values(), ids=ONE_EACH)
def test_every_study_has_a_report_before_it_has_begun(path, kept, tmp_path):
    spec = Spec.load(path, ["seeds=1"])
    html = page(kept(tmp_path, spec, done=0))
    assert f"<h1>{html_escape(spec.title or spec.study)}</h1>" in html
    assert f"report of study <code>{spec.study}</code>" in html
    assert "There is nothing to show yet." in html


def test_a_report_names_the_files_that_its_spec_needs(kept, tmp_path):
    (tmp_path / "mine.py").write_text("def alone(agents, bodies):\n    return []\n")
    own = tmp_path / "own.toml"
    own.write_text('seeds = 1\nepisodes = 1\nevaluation = 1\ntopology = "mine.py:alone"\n')
    html = page(kept(tmp_path / "kept", Spec.load(own), done=0))
    hint = html.partition("To run the study again")[2].partition("</p>")[0]
    assert "<code>mine.py</code>" in hint
    assert "<code>./dev exec nested-agents run study.toml --out DIR</code>" in hint


def test_a_study_of_team_sizes_has_a_section_on_scalability(kept, tmp_path):
    spec = Spec.of({**SIZES, "sweep": {"scenario.robots": [2, 4], "topology": ["chain", "star"]}})
    html = page(kept(tmp_path, spec, done=12))
    assert "scalability" in sections(html)
    for robots in (2, 4):  # hierarchies are compared within a size, not all with the first
        assert f"robots={robots}: evaluation success, minus that of chain" in html
    assert "Holm" in methods_of(html)
    section = html[html.index('<section id="scalability">') :].partition("</section>")[0]
    assert "Evaluation success was measured with 2 to 4 robots" in section
    assert section.count("<svg viewBox") >= 4, "four panels"
    assert '<pre id="scalability-csv" hidden>condition,seeds,evaluation success' in section
    assert len(re.findall(r'\bid="', html)) == len(set(re.findall(r'\bid="([^"]*)"', html)))


def test_hierarchies_without_a_picture_are_counted(kept, tmp_path):
    sweep = {"scenario.robots": [2, 3, 64], "topology": ["chain", "star"]}
    html = page(kept(tmp_path, Spec.of({**SIZES, "sweep": sweep}), done=0))
    section = html[html.index('<section id="hierarchy">') :].partition("</section>")[0]
    assert len(re.findall('aria-label="hierarchy: ', section)) == 4
    assert "4 of 6 hierarchies are shown." in section
    assert "more than 64 agents): robots=64, topology=chain; robots=64, topology=star." in section
    assert "exhaustive" in section, "the searches of the table try fewer joint actions"


def test_a_study_of_one_team_size_has_none(html):
    assert "scalability" not in sections(html)
