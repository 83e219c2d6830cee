"""The questions of the course: hand out sheets, grade what comes back.

Usage::

    python research/course/grade.py list
    python research/course/grade.py sheet LAB
    python research/course/grade.py check SHEET.toml ... [--format csv]

Exit statuses: 0 done and all answers right, 1 an answer is wrong or left out, 2 something that one
line on standard error names, 130 interrupted, 141 the reader of the output has gone.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any, Literal, NoReturn

from nested_agents import SpecError
from nested_agents.terminal import closest, run_to_status, show, write_csv

from labs import LABS, Lab

WIDTH = 80
"""Of a line [characters]."""


@dataclass(frozen=True)
class Mark:
    """What became of one answer."""

    question: str
    verdict: Literal["right", "wrong", "not answered"]
    hint: str = ""


@dataclass(frozen=True)
class Marks:
    """A graded sheet; printed a line for each question."""

    lab: str
    """Name of the lab."""
    name: str
    """Whose answers they are."""
    marks: tuple[Mark, ...]
    """In the order of the questions."""

    @property
    def right(self) -> int:
        """Number of right answers."""
        return sum(mark.verdict == "right" for mark in self.marks)

    def __str__(self) -> str:
        width = max(len(mark.question) for mark in self.marks) + 2
        lines = [f"{self.lab}{self.name and f', {self.name}'}: {self.right} of {len(self.marks)}"]
        for mark in self.marks:
            line = f"  {mark.question:<{width}}{mark.verdict}{mark.hint and f': {mark.hint}'}"
            lines.append(fill(line, WIDTH, subsequent_indent=" " * (width + 2)))
        return "\n".join(lines)

    __repr__ = __str__


def grade(lab: str, answers: Mapping[str, Any], name: str = "") -> Marks:
    """Grade the answers to the questions of a lab.

    Parameters
    ----------
    lab
        Its name, see `LABS`.
    answers
        By the keys of the questions. None and an empty text are no answers yet.
    name
        Whose answers they are.

    Raises
    ------
    SpecError
        If the lab or a key is unknown, or a value is none that the question takes; one line.

    Examples
    --------
    >>> print(grade("costs", {"chain": 87_380, "graph": 5}))
    costs: 1 of 6
      chain   right
      tree    not answered
      graph   wrong: an agent of a line has one neighbor or two
      factor  not answered
      step    not answered
      width   not answered
    """
    questions = _lab(lab).questions
    for key in answers:
        if key not in questions:
            raise SpecError(f"answers.{key}: unknown question; {closest(key, questions)}")
    marks = []
    for key, question in questions.items():
        answer = answers.get(key)
        if answer is None or answer == "":
            marks.append(Mark(key, "not answered"))
            continue
        try:
            is_right = question.is_right(answer)
        except ValueError as error:
            raise SpecError(f"answers.{key} = {show(answer)}: {error}") from None
        marks.append(Mark(key, "right") if is_right else Mark(key, "wrong", question.hint))
    return Marks(lab, name, tuple(marks))


def grade_sheet(path: Path) -> Marks:
    """Grade a sheet that has been filled in; a line that refuses it names the file."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        for key in table:
            if key not in ("lab", "name", "answers"):
                raise SpecError(f"{key}: unknown key; known: answers, lab, name")
        if "lab" not in table:
            raise SpecError(f"lab: missing; known: {', '.join(LABS)}")
        name, answers = table.get("name", ""), table.get("answers", {})
        if not isinstance(name, str):
            raise SpecError(f"name = {show(name)}: must be a text")
        if not isinstance(answers, dict):
            raise SpecError(f"answers = {show(answers)}: must be a table")
        return grade(table["lab"], answers, name)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, SpecError) as error:
        raise SpecError(f"{path}: {error}") from None


def blank_sheet(lab: str) -> str:
    """Return the questions of a lab as a TOML file in which the answers are left out.

    Raises
    ------
    SpecError
        If there is no such lab.
    """
    lines = [f"# {_lab(lab).title}", f'lab = "{lab}"', 'name = ""', "", "[answers]"]
    for number, (key, question) in enumerate(_lab(lab).questions.items(), 1):
        lines += ["", *_comment(f"{number}. {question.text}")]
        for line in question.form.splitlines():
            lines += _comment(f"   {line}")
        lines.append(f'{key} = ""')
    return "\n".join(lines)


def _comment(text: str) -> list[str]:
    return fill(text, WIDTH, initial_indent="# ", subsequent_indent="#    ").splitlines()


def _lab(name: Any) -> Lab:
    if name not in tuple(LABS):
        raise SpecError(f"lab = {show(name)}: unknown lab; {closest(name, LABS)}")
    return LABS[name]


def main(arguments: Sequence[str] | None = None) -> int:
    """List the labs, print the questions of one, or grade sheets; return the exit status."""
    return run_to_status("grade.py", lambda: _run(_Parser().parse_intermixed_args(arguments)))


class _Parser(argparse.ArgumentParser):
    """What the program takes; a line that refuses it is one."""

    def __init__(self) -> None:
        super().__init__(
            "grade.py", description="List the labs, print the questions of one, or grade answers."
        )
        self.add_argument("action", choices=["list", "sheet", "check"])
        self.add_argument("arguments", nargs="*", metavar="LAB|SHEET.toml")
        self.add_argument(
            "--format", choices=["text", "csv"], default="text", dest="form",
            help="of marks: every answer, or a row for each sheet (default: text)",
        )  # fmt: skip

    def error(self, message: str) -> NoReturn:
        """Refuse arguments as all else is refused."""
        raise SpecError(f"{message}; see {self.prog} --help")


def _run(given: argparse.Namespace) -> int:
    arguments = given.arguments
    if given.action == "list":
        if arguments:
            raise SpecError(f"list {arguments[0]}: takes no argument; see sheet")
        for name, lab in LABS.items():
            print(f"{name:<{max(map(len, LABS)) + 2}}{lab.title}")
        return 0
    if given.action == "sheet":
        if len(arguments) != 1:
            raise SpecError(f"sheet: takes one LAB, got {len(arguments)}; see list")
        print(blank_sheet(arguments[0]))
        return 0
    if not arguments:
        raise SpecError("check: SHEET.toml is missing; sheet LAB prints an empty one")
    graded = [grade_sheet(Path(path)) for path in arguments]
    if given.form == "csv":
        rows = [(m.lab, m.name, m.right, len(m.marks)) for m in graded]
        write_csv(sys.stdout, ("lab", "name", "right", "questions"), rows)
    else:
        print("\n\n".join(map(str, graded)))
    return 0 if all(m.right == len(m.marks) for m in graded) else 1


if __name__ == "__main__":
    raise SystemExit(main())
