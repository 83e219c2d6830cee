"""Sheets of answers: empty ones to hand out, filled ones to grade."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any, Literal

from ...core.plugins.messages import closest
from ..spec.errors import SpecError, show
from .labs import LABS, Lab

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
    """A graded sheet; printed a line for each question.

    Attributes
    ----------
    lab
        Name of the lab.
    name
        Whose answers they are.
    marks
        In the order of the questions.
    """

    lab: str
    name: str
    marks: tuple[Mark, ...]

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
      graph   wrong: an agent of a line has one neighbour or two
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
