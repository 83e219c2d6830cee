"""Words of messages: names that may have been meant, values as TOML writes them, arguments."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from numbers import Integral, Real
from types import UnionType


def near(name: object, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return "did you mean ...?" if a known name is near, else nothing.

    Examples
    --------
    >>> near("chian", ["chain", "tree"]), near("ring", ["chain", "tree"])
    ("did you mean 'chain'?", '')
    """
    matches = difflib.get_close_matches(str(name), list(known), n=1, cutoff=cutoff)
    return f"did you mean {matches[0]!r}?" if matches else ""


def closest(name: object, known: Iterable[str]) -> str:
    """Return "did you mean ...?" if a known name is near, and the known names in any case.

    Examples
    --------
    >>> closest("chian", ["chain", "tree"])
    "did you mean 'chain'? known: chain, tree"
    """
    known = sorted(known)
    return f"{near(name, known)} known: {', '.join(known) or 'none'}".lstrip()


def show(value: object, width: int | None = 60) -> str:
    """Return a value as TOML would write it, shortened to `width` characters if that is given."""
    if isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, int) and abs(value) >= 10**100:
        text = f"{Decimal(value):.3e}"  # Python writes some thousand digits at most
    elif isinstance(value, str):
        text = repr(value)
    elif isinstance(value, Mapping):
        text = "{" + ", ".join(f"{k} = {show(v, width)}" for k, v in value.items()) + "}"
    elif isinstance(value, Sequence):
        text = "[" + ", ".join(show(v, width) for v in value) + "]"
    else:
        text = " ".join(str(value).split())  # tables of pandas have lines
    return text if width is None or len(text) <= width else text[: width - 3] + "..."


def expect(allowed: str, kind: type | UnionType, /, **arguments: object) -> None:
    """Refuse arguments of a public function with types other than those allowed.

    Parameters
    ----------
    allowed
        What is allowed, in words.
    kind
        The allowed types. A bool does not count as a number.
    **arguments
        Values by name.

    Raises
    ------
    ValueError
        If one is of another type; it names the argument, its value and what is allowed.

    Examples
    --------
    >>> expect("the names of agents", list | tuple, agents=6)
    Traceback (most recent call last):
    ValueError: agents = 6, allowed: the names of agents
    >>> expect("a whole number", int, agents=True)
    Traceback (most recent call last):
    ValueError: agents = true, allowed: a whole number
    """
    for name, value in arguments.items():
        is_truth = isinstance(value, bool) and kind in (int, Integral, Real)
        if is_truth or not isinstance(value, kind):
            raise ValueError(f"{name} = {show(value)}, allowed: {allowed}")


def must_inherit(key: str, thing: object, base: type) -> None:
    """Refuse an object built from the settings of a key that does not inherit a base class.

    Raises
    ------
    ValueError
        If it does not; one line that names the key.

    Examples
    --------
    >>> must_inherit("learner.kind", "td", int)
    Traceback (most recent call last):
    ValueError: learner.kind: str must inherit nested_agents.int
    """
    if not isinstance(thing, base):
        name = type(thing).__name__
        raise ValueError(f"{key}: {name} must inherit nested_agents.{base.__name__}")


def expect_within(allowed: str, low: float, high: float, /, **arguments: float) -> None:
    """Refuse numbers outside a closed interval; NaN is refused, too.

    Parameters
    ----------
    allowed
        The interval in words.
    low, high
        Its bounds.
    **arguments
        Numbers by name.

    Raises
    ------
    ValueError
        If a number is not a number or out of range; it names the argument, its value and what is
        allowed.

    Examples
    --------
    >>> expect_within("0 to 1", 0.0, 1.0, level=2.0)
    Traceback (most recent call last):
    ValueError: level = 2.0, allowed: 0 to 1
    """
    expect(allowed, Real, **arguments)
    for name, value in arguments.items():
        if not low <= value <= high:
            raise ValueError(f"{name} = {show(value)}, allowed: {allowed}")


def expect_each(
    allowed: str, kind: type | UnionType, /, **sequences: Iterable[object] | None
) -> None:
    """Refuse elements of sequences given to a public function that are of no allowed type.

    Parameters
    ----------
    allowed
        What is allowed, in words.
    kind
        The types of it.
    **sequences
        Sequences by name; None counts as empty.

    Raises
    ------
    ValueError
        If one is of another type; it names the argument, the index, its value, what is allowed.

    Examples
    --------
    >>> expect_each("the names of agents", str, agents=["a", 6])
    Traceback (most recent call last):
    ValueError: agents[1] = 6, allowed: the names of agents
    """
    for name, given in sequences.items():
        values = () if given is None else given
        expect(allowed, Iterable, **{name: values})
        for index, value in enumerate(values):
            expect(allowed, kind, **{f"{name}[{index}]": value})


def expect_pairs(allowed: str, /, **sequences: Iterable[object]) -> None:
    """Refuse elements that are not pairs, as `expect_each` does."""
    expect_each(allowed, list | tuple, **sequences)
    for name, pairs in sequences.items():
        for index, pair in enumerate(pairs):
            if isinstance(pair, list | tuple) and len(pair) != 2:
                raise ValueError(f"{name}[{index}] = {show(pair)}, allowed: {allowed}")


def shallowest(names: Iterable[str]) -> list[str]:
    """Return the dotted names with the fewest parts, each once.

    Examples
    --------
    >>> shallowest(["scenario.leader.learner.ridge", "learner.ridge"])
    ['learner.ridge']
    """
    depths = {name: name.count(".") for name in names}
    return [name for name, depth in depths.items() if depth == min(depths.values())]
