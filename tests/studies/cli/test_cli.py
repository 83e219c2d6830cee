import csv
import io
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import made_up
import pytest
from made_up_commands import Command, finish, heeding_interrupts, run_here, wait_for_results

from nested_agents.studies.api import running as studies_run
from nested_agents.studies.api.study import StudyResults
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli import commands
from nested_agents.studies.cli.main import COMMANDS, main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import DATABASE


@pytest.fixture(scope="module")
def study(tmp_path_factory, spec_file):
    """A finished study, and what the run said."""
    directory = tmp_path_factory.mktemp("study") / "out"
    line = ["run", spec_file, "--out", directory, "--figures", "png", "--figures", "svg"]
    return directory, run_here(made_up.measure, *line)


def results(directory, form="csv", *arguments, capsys=None):
    capsys.readouterr()
    assert main(["results", str(directory), "--format", form, *arguments]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([*command.split(), "--help"]) == 0
    out = capsys.readouterr().out
    assert out.startswith(" ".join(["Usage: nested-agents", *command.split(), "[OPTIONS]"]))
    assert "-h, --help" in out
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("line", "modules"),
    [(["--help"], []), (["--version"], []), (["cost", "--help"], ["describing"])],
)
def test_help_and_version_import_little(line, modules):
    program = (
        "import sys; from nested_agents.__main__ import main; main(); "
        "heavy = {'numpy', 'numba', 'joblib', 'matplotlib', 'scipy'} & set(sys.modules); "
        "commands = {m.rpartition('.')[2] for m in sys.modules if '.cli.commands.' in m}; "
        "print(sorted(heavy | commands), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program, *line], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, f"{modules}\n")


def test_every_command_has_a_module_and_a_line_of_help(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([]) == 0
    out = capsys.readouterr().out
    assert re.findall(r"^  ([a-z]+)  ", out, re.MULTILINE) == list(COMMANDS)
    modules = {path.stem for path in Path(commands.__file__).parent.glob("*.py")}
    places = {f".commands.{module}" for module in modules - {"__init__"}}
    assert places == {place for place, _ in COMMANDS.values()}


def test_version(capsys):
    assert main(["--version"]) == 0
    assert re.fullmatch(r"nested-agents \d+\.\d+\.\d+\S*\n", capsys.readouterr().out)


def test_a_study_from_spec_to_figures(study):
    directory, (status, out, err) = study
    assert (status, err.splitlines()[-1].split(",")[0]) == (0, "6 of 6 trials")
    assert "default" in out
    assert "95% intervals" in out
    for name in ("learning-curves.png", "learning-curves.svg"):
        assert str(directory / "figures" / name) in out
        assert (directory / "figures" / name).stat().st_size > 1000


def test_it_fits_a_terminal_of_80_columns(study):
    _, (_, out, _) = study
    table = out.split("\n\n")[0].splitlines()
    assert [line.split()[0] for line in table[-2:]] == ["default", "frozen"]
    assert max(map(len, table)) <= 80


def test_results_in_every_form(study, capsys):
    directory, _ = study
    rows = list(csv.DictReader(io.StringIO(results(directory, capsys=capsys))))
    assert len(rows) == 2 * 3 * 4
    assert list(rows[0]) == [
        "condition", "preset", "seed", "phase", "episode", "steps", "success", "stopped_at_goal",
        "final_distance_m", "contact_fraction", "return",
    ]  # fmt: skip
    objects = json.loads(results(directory, "json", capsys=capsys))
    assert len(objects) == len(rows)
    for row, item in zip(rows, objects, strict=True):
        assert float(row["return"]) == item["return"]
        assert bool(int(row["success"])) is item["success"]
    table = results(directory, "table", "--phase", "evaluation", capsys=capsys)
    lines = table.splitlines()
    assert len([line for line in lines if line.split()[:1] in (["0"], ["1"], ["2"])]) == 2 * 3 * 2
    assert [line for line in lines if "evaluation" in line] == [
        "default, evaluation", "frozen, evaluation",
    ]  # fmt: skip
    assert max(map(len, lines)) <= 80


def test_the_same_command_again_runs_nothing(study, spec_file, capsys):
    directory, _ = study
    before = results(directory, capsys=capsys)
    status, _, err = run_here(made_up.failing, "run", spec_file, "--out", directory)
    assert (status, err) == (0, "6 of 6 trials were run before\n")
    assert results(directory, capsys=capsys) == before


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_interrupted_and_continued_is_as_if_never_interrupted(
    how, study, spec_file, tmp_path, capsys
):
    arguments = ["run", spec_file, "--out", tmp_path, "--jobs", 2]
    process = Command("endless", *arguments, start_new_session=True)
    wait_for_results(tmp_path, process)
    if how == signal.SIGINT:  # as a terminal does it: to the parent and its workers
        os.killpg(process.pid, how)
    else:
        process.send_signal(how)
    status, _, err = finish(process)
    if how == signal.SIGINT:
        assert status == 130
        assert re.search(r"interrupted: [12] of 6 trials are kept in", err)
        assert "Traceback" not in err
    kept = {p.name: p.stat().st_mtime_ns for p in (tmp_path / "recordings").glob("[!.]*.npz")}
    assert run_here(made_up.measure, "run", spec_file, "--out", tmp_path)[0] == 0
    now = {p.name: p.stat().st_mtime_ns for p in (tmp_path / "recordings").glob("[!.]*.npz")}
    assert len(now) == 6
    # A kill may fall between a recording and its note in the ledger: that one runs again.
    again = [name for name in kept if kept[name] != now[name]]
    assert len(again) <= (1 if how == signal.SIGKILL else 0)
    for phase in ("training", "evaluation"):
        whole, resumed = (
            results(d, "json", "--phase", phase, capsys=capsys) for d in (study[0], tmp_path)
        )
        assert whole == resumed
    for name in now:
        path = Path("recordings") / name
        assert (tmp_path / path).read_bytes() == (study[0] / path).read_bytes()


def test_failed_trials_are_told_kept_and_retried(spec_file, tmp_path, capsys):
    out = tmp_path / "out"
    status, _, err = run_here(made_up.failing, "run", spec_file, "--out", out)
    assert status == 1
    assert "failed: frozen, seed 1: RuntimeError: a wheel came off" in err
    assert main(["status", str(out)]) == 1
    said = capsys.readouterr().out
    assert "done     5 of 6 trials" in said
    assert "in failing" in said
    assert run_here(made_up.measure, "retry", out)[0] == 0
    assert main(["status", str(out)]) == 0
    assert "done     6 of 6 trials" in capsys.readouterr().out


def test_presets(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["presets"]) == 0
    listed = capsys.readouterr().out
    assert max(map(len, listed.splitlines())) <= 80
    assert main(["presets", "paper"]) == 0
    assert "paper" in listed
    assert "step_size = 0.00012" in capsys.readouterr().out


def test_the_demo_draws_what_is_learned_first_and_then_the_first_episode(
    tmp_path, monkeypatch, capsys
):
    drawn = []
    rendering = ModuleType("rendering")
    rendering.animate = lambda recording, path: (drawn.append(recording), path.touch())
    monkeypatch.setitem(
        sys.modules, "nested_agents.scenarios.box_pushing.pictures.rendering", rendering
    )
    monkeypatch.setattr(learning_curve, "measure", made_up.measure)
    monkeypatch.setattr(studies_run, "check_conditions", lambda spec, **_: made_up.MEASURES)
    report = tmp_path / "report.html"
    monkeypatch.setattr(StudyResults, "report", lambda study: report)
    assert main(["demo", "--out", str(tmp_path), "--jobs", "1"]) == 0
    printed, seen = capsys.readouterr()
    assert seen.index("what the first trial has learned:") < seen.index("of 32 trials")
    assert len(drawn) == 2
    assert f"report  {report}\n" in printed
    assert sorted(p.name for p in (tmp_path / "replay").iterdir()) == [
        "first-episode.gif", "last-episode.gif",
    ]  # fmt: skip


def test_commands_are_printed_as_they_can_be_typed(monkeypatch, capsys):
    monkeypatch.setenv("NESTED_AGENTS_DEV", "./dev")
    assert main(["keys"]) == 0
    assert "./dev exec nested-agents keys PREFIX" in capsys.readouterr().out
    assert main(["keys", "--wrong"]) == 2
    assert "see ./dev exec nested-agents keys --help" in capsys.readouterr().err
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("nested-agents ")


def test_every_command_that_a_study_prints_can_be_typed(spec_file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NESTED_AGENTS_DEV", "../dev")
    status, out, _ = run_here(made_up.measure, "run", spec_file, "--out=-out")
    printed = re.findall(r"^\w+ +\.\./dev exec nested-agents (.*)$", out, re.MULTILINE)
    assert status == 0
    assert len(printed) == 2
    for arguments in printed:
        assert main(shlex.split(arguments)) == 0


def test_the_demos_spec_is_valid_toml(capsys, tmp_path):
    assert main(["demo", "--print-spec"]) == 0
    spec = Spec.parse(capsys.readouterr().out)
    assert [c.label for c in spec.conditions()] == ["default", "frozen", "random", "planner"]
    assert len(spec.seeds) >= 8


BAD = {
    "run missing.toml --out x": "missing.toml: No such file or directory",
    "run {spec} --out x --set robots=3": (
        "robots = 3: unknown key; did you mean 'scenario.robots'?"
    ),
    "run {spec} --out x --set evaluator=exact": (
        "evaluator = 'exact': unknown key; did you mean 'learner.decision.evaluator'?"
    ),
    "run {spec} --out x --set episodez=3": "episodez = 3: unknown key; did you mean 'episodes'",
    "run {spec} --out x --set episodes=-3": "episodes = -3: must be at least 1",
    "run {spec} --out x --set episodes": "--set episodes: expected key=value",
    "run {spec} --out x --set topology=chan": "'chan'",
    "run {spec} --out x --set steps=4 seeds=a": "seeds = 'a'",
    "run {spec} --out x --set sweep.learner.ridge=[1] learner.ridge=2": (
        "--set learner.ridge=2: has no effect, because the spec sweeps learner.ridge; set sweep."
    ),
    "run {spec} --out x --jobs 0": "--jobs 0: must be at least 1",
    "run {spec} --out x --jobs two": "'--jobs': 'two' is not a valid integer",
    "run {spec} --out x --jobs 1.5": "'--jobs': '1.5' is not a valid integer",
    "run {spec} --out ''": "error: --out: must not be empty; see nested-agents",
    "run '' --out x": "error: an argument: must not be empty; see nested-agents run --help",
    "run {spec} --out x --set ''": "error: --set: must not be empty",
    "demo --out=": "error: --out: must not be empty",
    "demo --out ''": "error: --out: must not be empty; see nested-agents",
    "export '' --out x": "error: an argument: must not be empty",
    "explain a --seed x": "error: Invalid value for '--seed': 'x' is not a valid integer",
    "check '' --steps 5": "error: an argument: must not be empty",
    "check {spec} --steps 0": "error: steps = 0: must be at least 2",
    "cost --topology ''": "error: --topology: must not be empty",
    "run {spec} --out {spec}": "spec.toml: ",
    "run {spec} --out /proc/nowhere/x": "/proc/nowhere",
    "run {spec}": "error: Missing option '--out'; see nested-agents run --help",
    "run": "error: Missing argument 'SPEC.toml'; see nested-agents run --help",
    "run {spec} --out": "'--out' requires an argument; see nested-agents run --help",
    "demo --out --print-spec": "error: --out --print-spec: is an option; a value must come first",
    "results nowhere": "nowhere: holds no study",
    "results nowhere --format xml": "'--format': 'xml' is not one of 'table', 'csv', 'json'",
    "status nowhere": "nowhere: holds no study",
    "retry nowhere": "nowhere: holds no study",
    "presets papr": "did you mean 'paper'",
    "rum": "error: rum: unknown command; did you mean 'run'? known: check, compare",
    "--versio": "'--versio'. Did you mean '--version'?",
    "demo --job 3": "No such option '--job'. (Did you mean one of: '--jobs', '--out'?)",
    "demo extra": "unexpected extra argument (extra); see nested-agents demo --help",
}


@pytest.mark.parametrize("delay", [0.02, 0.05, 0.1, 0.2, 0.3])
def test_an_interrupt_while_starting_up_is_silent(delay):
    """From when `main` has its handler; what Python does before is not ours."""
    program = (
        "import sys; from nested_agents import __main__ as program; "
        "opened = program.open_standard_streams; "
        "program.open_standard_streams = lambda: print(flush=True) or opened(); "
        "sys.exit(program.main())"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, "presets", "paper"], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, preexec_fn=heeding_interrupts,
    )  # fmt: skip
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    status, _, err = finish(process)
    assert (status, err) in ((130, ""), (0, ""))


def test_several_values_of_one_option_and_of_repeated_ones(spec_file, capsys):
    first, second = "episodes=-1", "learner.ridge=-2"
    for line in (["--set", first, second], ["--set", first, "--set", second]):
        for order in ([*line, str(spec_file)], [str(spec_file), *line]):
            assert main(["check", *order]) == 2
            assert "episodes = -1" in capsys.readouterr().err


@pytest.mark.parametrize("line", BAD)
def test_bad_input_is_one_line_and_status_2(line, spec_file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(line.format(spec=spec_file))) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(r"nested-agents: error: [^\n]+\n", err)
    assert BAD[line] in err
    assert list(tmp_path.iterdir()) == []


def test_a_reader_that_goes_away_is_no_error(study):
    command = [sys.executable, "-m", "nested_agents", "results", str(study[0])]
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, "")


def test_a_damaged_database_is_one_line(study, tmp_path, capsys):
    (tmp_path / DATABASE).write_bytes((study[0] / DATABASE).read_bytes()[:5000])
    assert main(["results", str(tmp_path)]) == 2
    assert re.fullmatch(r"nested-agents: error: [^\n]+\n", capsys.readouterr().err)


def test_a_study_whose_trials_all_fail_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dies.py").write_text(
        "import nested_agents as na\n"
        "from nested_agents.scenarios.line_up import LineUp\n\n\nclass Dies(LineUp):\n"
        "    class Settings(na.ScenarioSettings):\n        carts: int = 2\n\n"
        "    def step(self, joint_action):\n        raise RuntimeError('dies')\n"
    )
    (tmp_path / "spec.toml").write_text(
        'seeds = 1\nepisodes = 1\nsteps = 2\nscenario = { kind = "dies.py:Dies" }\n'
    )
    line = ["run", str(tmp_path / "spec.toml"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main(line) == 1
    out, err = capsys.readouterr()
    assert "no trial has finished" in out
    assert "1 trial failed: nested-agents status" in err
    assert main(["compare", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == "nested-agents: error: no trial has finished\n"
