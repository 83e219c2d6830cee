"""How the command line reads its arguments: texts, paths, numbers, choices, several values.

Every type refuses in the same words, ``VALUE: what is allowed``, before which `complaint` puts the
name of the option.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from shlex import quote
from typing import Any

import click

from ...core.plugins.messages import closest


class Text(click.ParamType):
    """A text that is not empty, as that of an unset shell variable is."""

    name = "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the text, unless it is empty or an option whose own value was forgotten."""
        if not value:
            self.fail("'': must not be empty", param, ctx)
        if ctx is not None and value in _options(ctx):
            self.fail(f"{value}: is an option; a value must come first", param, ctx)
        return value


class File(Text):
    """A path, which need not exist."""

    name = "path"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        return value if isinstance(value, Path) else Path(super().convert(value, param, ctx))


class Whole(click.ParamType):
    """A whole number."""

    name = "n"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number."""
        try:
            return int(value)
        except ValueError:
            self.fail(f"{quote(value)}: must be a whole number", param, ctx)


class Number(click.ParamType):
    """A number."""

    name = "x"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number."""
        try:
            return float(value)
        except ValueError:
            self.fail(f"{quote(value)}: must be a number", param, ctx)


class Choice(click.Choice):
    """One of some words."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        """Return what is allowed in place of the value."""
        return f"{quote(str(value))}: {closest(value, self.choices)}"


class Several(click.Option):
    """An option that takes one value or more, and may be given again for further ones."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **{**kwargs, "multiple": True})

    def takes(self, value: str) -> bool:
        """Tell whether an argument is one more value."""
        return not value.startswith("-")


class Assignments(Several):
    """The same for ``key=value``, after which arguments of another form may stand."""

    def takes(self, value: str) -> bool:
        """Tell whether an argument is one more assignment."""
        return super().takes(value) and "=" in value


class Command(click.Command):
    """A command that may have `Several` options."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the arguments, after every further value has got an option of its own."""
        try:
            return super().parse_args(ctx, list(self._separated(args)))
        except click.UsageError as error:
            error.ctx = error.ctx or ctx
            raise

    def _separated(self, arguments: Iterable[str]) -> Iterator[str]:
        several = {n: option for option in self.params for n in option.opts
                   if isinstance(option, Several)}  # fmt: skip
        current, has_value = "", False
        for argument in arguments:
            if argument in several:
                current, has_value = argument, False
            elif current and not has_value:
                has_value = True
            elif current and several[current].takes(argument):
                yield current
            else:
                current = ""
            yield argument


def complaint(error: click.UsageError) -> str:
    """Return one line on what is wrong with the arguments: which, its value, what is allowed."""
    help_of = f"see {error.ctx.command_path} --help" if error.ctx else "see --help"
    if isinstance(error, click.NoSuchOption) and error.ctx:
        name = error.option_name
        return f"{name}: unknown option; {closest(name, _options(error.ctx))}"
    if isinstance(error, click.BadParameter) and error.param:
        name = _name(error.param)
        is_missing = isinstance(error, click.MissingParameter)
        return f"{name}: is missing; {help_of}" if is_missing else f"{name} {error.message}"
    return f"{error.format_message().rstrip('.')}; {help_of}"


def _options(ctx: click.Context) -> set[str]:
    """Return the options of a command as they are written."""
    params = ctx.command.get_params(ctx)
    return {
        name
        for param in params
        if isinstance(param, click.Option)
        for name in (*param.opts, *param.secondary_opts)
        if name.startswith("--")
    }


def _name(param: click.Parameter) -> str:
    """Return what an argument is called in the help."""
    is_option = isinstance(param, click.Option)
    return max(param.opts, key=len) if is_option else str(param.metavar or param.name)
