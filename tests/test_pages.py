"""README, CONTRIBUTING and all further pages: every block that is code runs, parses or validates.

The blocks of a page are taken in order, in one folder and one Python namespace. A block whose first
line is ``# name.py`` or ``# name.toml`` is that file. Python runs as it stands. TOML is a spec, or
a part of one. A command of the program is parsed with its options; those of tutorials are also run,
on a smaller scale. A line ``# not tested: REASON`` at the top of a block excludes it.
"""

from __future__ import annotations

import itertools
import json
import re
import runpy
import shlex
import tomllib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import click
import pytest

import nested_agents as na
from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.cli.main import main, nested_agents
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions

ROOT = Path(__file__).resolve().parent.parent
GENERATED = ("docs/reference/", "docs/gallery/", "docs/_build/", "docs/notebooks/")
PAGES = sorted(
    page
    for path in (
        *(ROOT / "README.md", ROOT / "CONTRIBUTING.md"),
        *(
            page
            for folder in ("docs", "plugins", "research")
            for page in (ROOT / folder).rglob("*.md")
        ),
    )
    if not (page := path.relative_to(ROOT).as_posix()).startswith(GENERATED)
)
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
NAME = re.compile(r"# (\w+\.\w+)\b")
UNTESTED = re.compile(r"^# not tested: \S", re.MULTILINE)
LANGUAGES = {"text", "bibtex"}
DEV = set(re.findall(r"^  ([a-z]+)  ", (ROOT / "dev").read_text(encoding="utf-8"), re.MULTILINE))
OTHER_PROGRAMS = {"cp", "eval", "pip"}
SMALL = ("seeds=2", "episodes=2", "steps=8", "evaluation=1")
NOT_RUN = ("--backend dask", "--measured", "--out /tmp")
"""Commands of tutorials that need a cluster or take long; other tests run their like."""


def blocks(page: str) -> list[tuple[str, str]]:
    """Return the language and text of the blocks of a page."""
    return BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))


def commands(text: str) -> Iterator[list[str]]:
    """Yield the commands of a shell block as words, without what follows a pipe."""
    for line in text.replace("\\\n", " ").splitlines():
        for part in line.removeprefix("$ ").split(" && "):
            words = shlex.split(part, comments=True)
            if words:
                yield words


def check_command(words: list[str]) -> list[str]:
    """Refuse a command that cannot be typed in a checkout; return the arguments of the program."""
    assert words[0] not in ("nested-agents", "python"), f"{words}: put ./dev exec before it"
    if words[0] != "./dev":
        assert words[0] in OTHER_PROGRAMS, words
        return []
    assert words[1] in DEV, words
    if words[1] != "exec" or len(words) == 2:
        return []
    program, *arguments = words[2:]
    if program == "nested-agents":
        parse(
            nested_agents, click.Context(nested_agents, **nested_agents.context_settings), arguments
        )
        return arguments
    assert program in ("python", "pip", "dask"), words
    if program == "python":
        is_there = arguments[0] == "-m" and find_spec(arguments[1]) is not None
        assert is_there or (ROOT / arguments[0]).is_file(), words
    return []


def parse(group: click.Group, context: click.Context, arguments: list[str]) -> None:
    """Parse arguments as the command line does, and run nothing."""
    name, command, rest = group.resolve_command(context, list(arguments))
    assert command is not None
    within = command.make_context(name, list(rest), parent=context)
    if isinstance(command, click.Group):
        parse(command, within, rest)


def check_spec(name: str, text: str, folder: Path) -> None:
    """Validate a spec or a part of one, and that its conditions can be built."""
    if name == "pyproject.toml":
        tomllib.loads(text)
    else:
        spec = Spec.parse(text, sources=Sources(folder))
        check_conditions(spec)


def check_changes(path: str, *options: str) -> None:
    """Validate a spec with the changes of the option ``--set``."""
    after = options[options.index("--set") + 1 :] if "--set" in options else ()
    changes = [*itertools.takewhile(lambda word: not word.startswith("--"), after)]
    Spec.load(path, changes)


def smaller(arguments: list[str], page: str) -> list[str]:
    """Return the arguments of a command of a tutorial, such that a study is small."""
    if arguments[0] != "run":
        return arguments
    arguments = [part for part in arguments if part not in ("--jobs", "1", "2")]
    changes = [*SMALL]
    if page.endswith("wheel_failures.md"):
        failure = '{kind="reversed",wheels="robot1.front-left",episode=5}'
        changes = ["seeds=2", "episodes=10", "steps=100", f"scenario.failures=[{failure}]"]
    if page.endswith("pettingzoo.md"):
        changes = ["seeds=2", "decisions=4096", "steps=8", "evaluation=1"]
    shown = ["--set"] if "--set" not in arguments else []
    return [*arguments, *shown, *changes, "--jobs", "1"]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_of_a_page(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in ("research", "studies", "examples"):  # of the checkout, where commands are typed
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    names: dict[str, object] = {"__name__": "__main__"}
    for language, text in blocks(page):
        named = NAME.match(text)
        name = named[1] if named else ""
        if name:
            Path(name).write_text(text, encoding="utf-8")
        if UNTESTED.search(text):
            continue
        if language == "python":
            code = compile(text, name or page, "exec")
            exec(code, {"__name__": name.removesuffix(".py")} if name else names)
        elif language == "toml":
            check_spec(name, text, tmp_path)
        elif language == "json":
            json.loads(text)
        elif language in ("sh", "bash"):
            for words in commands(text):
                arguments = check_command(words)
                if arguments[:1] == ["run"] and Path(arguments[1]).is_file():
                    check_changes(*arguments[1:])
                is_run = language == "sh" and "tutorials/" in page  # bash: a script
                if arguments and is_run and not any(part in " ".join(words) for part in NOT_RUN):
                    assert main(smaller(arguments, page)) == 0, words
                    assert capsys.readouterr().out
        else:
            assert language in LANGUAGES, f"{page}: a block of {language}"
            for words in commands("\n".join(re.findall(r"^\$ .*", text, re.MULTILINE))):
                check_command(words)


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_in_sentences_of_a_page(page: str) -> None:
    prose = BLOCK.sub("", (ROOT / page).read_text(encoding="utf-8"))
    for text in re.findall(r"`((?:\./dev |nested-agents |python )[^`]*)`", prose):
        words = shlex.split(text)
        is_help = words[-1] == "--help"
        if not is_help and (words[0] != "nested-agents" or len(words) > 2):  # two name a command
            check_command(words)


LINK = re.compile(r"(?:\[([^]]*)\]\(|(?:src|href)=\")([^)#\s\"]*)(?:#([^)\s\"]*))?[)\"]")


def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub and the site make them."""
    headings = re.findall(r"^#{1,6} (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    words = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {text.strip().replace(" ", "-") for text in words}


@pytest.mark.parametrize("page", PAGES)
def test_the_links_of_a_page_lead_somewhere(page: str) -> None:
    path = ROOT / page
    for text, target, anchor in LINK.findall(BLOCK.sub("", path.read_text(encoding="utf-8"))):
        if target.startswith("https://"):
            continue
        file = path.parent / target if target else path
        assert file.exists(), f"{page}: {target}"
        assert not file.resolve().relative_to(ROOT).as_posix().startswith(GENERATED), target
        assert not anchor or anchor in anchors(file), f"{page}: {target}#{anchor}"
        assert text or not target.endswith(".md"), f"{page}: {target} has no text, see GitHub"


def test_every_page_is_in_the_navigation() -> None:
    pages = runpy.run_path(str(ROOT / "docs" / "site_pages.py"))
    below = [
        f"{str(Path(page).parent) + '/' if '/' in page else ''}{name}"
        for page, names in pages["CONTENTS"].items()
        for name in names
    ]
    listed = {*below, *(name for names in pages["NAVIGATION"].values() for name in names)}
    written = {page.removeprefix("docs/").removesuffix(".md") for page in PAGES if "docs/" in page}
    assert written - listed == {"index"}
    assert {page for page in PAGES if "notebooks/" in page} == {
        f"research/{name}.md" for name in listed if name.startswith("notebooks/")
    }


def test_every_public_name_is_on_one_page_of_the_api() -> None:
    documented_names = runpy.run_path(str(ROOT / "docs" / "site_pages.py"))["documented_names"]
    texts = [page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "api").glob("*.md")]
    names = [name for text in texts for name in documented_names(text)]
    assert sorted(names) == sorted(set(na.__all__) - {"__version__"})
