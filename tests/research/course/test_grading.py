"""Sheets of answers: what is right, wrong, left out, and refused."""

import doctest
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import pytest

import nested_agents as na
from nested_agents.core.agents.cost import Problem, below_counts
from nested_agents.studies.errors import SpecError

import grade as program
import labs
import questions
from grade import blank_sheet, grade, grade_sheet, main
from labs import LABS, WHEELS
from questions import Choice, Edges, Numeric

FRUGAL = [
    [f"robot{n}.left", f"robot{m}.right"] for n in range(1, 5) for m in (n, n + 1) if m < 5
]  # fmt: skip


def right_answers(lab: str) -> dict[str, object]:
    """Answers that are right, made from the questions but for the hierarchy."""
    answers: dict[str, object] = {}
    for key, question in LABS[lab].questions.items():
        match question:
            case Numeric():
                answers[key] = question.answer
            case Choice():
                answers[key] = question.right
            case _:
                answers[key] = FRUGAL
    return answers


@pytest.mark.parametrize("lab", LABS)
def test_right_answers_get_all_marks(lab: str) -> None:
    marks = grade(lab, right_answers(lab), "Ada")
    assert marks.right == len(marks.marks)
    assert str(marks).startswith(f"{lab}, Ada: {marks.right} of {marks.right}\n")


@pytest.mark.parametrize("lab", LABS)
def test_a_blank_sheet_is_a_sheet_without_answers(lab: str, tmp_path: Path) -> None:
    path = tmp_path / "blank.toml"
    path.write_text(blank_sheet(lab))
    marks = grade_sheet(path)
    assert marks.lab == lab
    assert {mark.verdict for mark in marks.marks} == {"not answered"}
    assert max(map(len, blank_sheet(lab).splitlines())) <= 80


@pytest.mark.parametrize("lab", LABS)
def test_every_wrong_answer_gets_a_hint(lab: str) -> None:
    wrong = {
        key: 0.5 if isinstance(question, Numeric) else next(o for o in "ab" if o != question.right)
        for key, question in LABS[lab].questions.items()
        if isinstance(question, Numeric | Choice)
    }
    marks = {mark.question: mark for mark in grade(lab, wrong).marks}
    assert all(marks[key].verdict == "wrong" and marks[key].hint for key in wrong)


def test_costs_are_those_of_the_pages() -> None:
    costs = LABS["costs"].questions
    assert (costs["chain"].answer, costs["graph"].answer) == (87_380, 416)  # type: ignore[attr-defined]
    lines = [
        Problem(actions=4).decision(
            below_counts(na.build_hierarchy(na.parse_topology("coordination-graph"), names))
        )
        for names in ([f"a{i}" for i in range(n)] for n in (20, 21))
    ]
    assert lines[1] - lines[0] == costs["step"].answer  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("pairs", "is_right"),
    [
        (FRUGAL, True),
        ([list(pair) for pair in pairwise(WHEELS)], False),  # too dear
        ([[WHEELS[i], WHEELS[i + 1]] for i in (0, 2, 4, 6)], False),  # robots apart
        ([[WHEELS[i], WHEELS[i + 2]] for i in (0, 1, 2, 3, 4, 5)], False),  # wheels apart
    ],
)
def test_a_hierarchy_is_graded_by_its_edges(pairs: list[list[str]], is_right: bool) -> None:
    (question,) = (q for q in LABS["own-hierarchy"].questions.values() if isinstance(q, Edges))
    assert question.is_right(pairs) is is_right


@pytest.mark.parametrize(
    ("sheet", "said"),
    [
        ("lab = 'climbing'", "lab = 'climbing': unknown lab; did you mean 'climbing-game'? "),
        ("name = 'Ada'", "lab: missing; known: "),
        ("lab = 'costs'\nanswer = {}", "answer: unknown key; known: answers, lab, name"),
        ("lab = 'costs'\nname = 3", "name = 3: must be a text"),
        ("lab = 'costs'\nanswers = 3", "answers = 3: must be a table"),
        ("lab = 'costs'\nanswers.chian = 3", "answers.chian: unknown question; did you mean "),
        ("lab = 'costs'\nanswers.chain = 'x'", "answers.chain = 'x': must be a number"),
        ("lab = 'costs'\nanswers.chain = true", "answers.chain = true: must be a number"),
        ("lab = 'costs'\nanswers.width = 'C'", "answers.width = 'C': must be one of a, b, c"),
        ("lab = 'own-hierarchy'\nanswers.edges = [1]", "must be a list of pairs of names"),
        (
            "lab = 'own-hierarchy'\nanswers.edges = [['a', 'b']]",
            "answers.edges = [['a', 'b']]: hierarchy: ",
        ),
        ("lab =", "sheet.toml: "),
    ],
)
def test_what_is_no_answer_is_refused_in_one_line(
    sheet: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "sheet.toml"
    path.write_text(sheet)
    with pytest.raises(SpecError) as refused:
        grade_sheet(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert said in str(refused.value)
    assert main(["check", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(LABS)
    assert main(["sheet", "costs"]) == 0
    sheet = capsys.readouterr().out
    blank, full = tmp_path / "blank.toml", tmp_path / "full.toml"
    blank.write_text(sheet)
    for key, answer in right_answers("costs").items():
        shown = f'"{answer}"' if isinstance(answer, str) else answer
        sheet = sheet.replace(f'\n{key} = ""\n', f"\n{key} = {shown}\n")
    full.write_text(sheet)
    assert main(["check", str(full)]) == 0
    assert "right" in capsys.readouterr().out
    assert main(["check", str(full), str(blank), "--format", "csv"]) == 1
    assert capsys.readouterr().out == "lab,name,right,questions\ncosts,,6,6\ncosts,,0,6\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ["list", "costs"], ["sheet"], ["sheet", "a", "b"], ["sheet", "cost"], ["check"], [],
        ["grade"], ["check", "no-such-file.toml"], ["check", "a.toml", "--format", "xml"],
        ["list", "--lab"],
    ],
)  # fmt: skip
def test_the_command_refuses_in_one_line(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_program_runs_from_any_folder(tmp_path: Path) -> None:
    path = tmp_path / "sheet.toml"
    path.write_text(blank_sheet("climbing-game"))
    command = [sys.executable, program.__file__, "check", "--format", "csv", path.name]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.stdout == "lab,name,right,questions\nclimbing-game,,0,7\n"
    assert (run.returncode, run.stderr) == (1, "")


@pytest.mark.parametrize("module", [program, labs, questions])
def test_the_examples_of_the_docstrings_hold(module: ModuleType) -> None:
    assert doctest.testmod(module).failed == 0
