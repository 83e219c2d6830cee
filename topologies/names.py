"""Names of agents, checked and written in messages."""

from collections import Counter
from collections.abc import Iterable, Sequence


def check_names(
    names: Sequence[str], agents: Sequence[str], what: str, *, all_needed: bool = True
) -> None:
    """Refuse `names` unless they are the agents, each named once.

    Parameters
    ----------
    names
        The names to check.
    agents
        The agents that exist.
    what
        The argument that holds the names, for the message.
    all_needed
        Whether every agent must be among the names.

    Raises
    ------
    ValueError
        If a name is unknown, occurs twice or is missing.
    """
    known = set(agents)
    for name, times in Counter(names).items():
        if name not in known:
            raise ValueError(f"unknown agent {quote(name)} in {what}, known: {join_names(agents)}")
        if times > 1:
            raise ValueError(f"agent {quote(name)} occurs more than once in {what}")
    missing = known.difference(names)
    if all_needed and missing:
        first = next(agent for agent in agents if agent in missing)
        raise ValueError(f"agent {first!r} is missing from {what}")


def check_legible(names: Iterable[object]) -> None:
    """Refuse names that are neither printable text nor whole numbers.

    Raises
    ------
    ValueError
        If there is such a name; the message shows it escaped and shortened.
    """
    for name in names:
        is_name = isinstance(name, str | int) and not isinstance(name, bool)
        if not is_name or not str(name) or not str(name).isprintable():
            raise ValueError(f"{quote(name)} is no name of an agent, allowed: printable text")


def quote(value: object, most: int = 60) -> str:
    r"""Return a value for a message: at most `most` characters, with control characters escaped.

    Examples
    --------
    >>> quote("a\nb"), quote("n" * 100, most=10)
    ("'a\\nb'", "'nnnnnn...")
    """
    text = ascii(value) if not isinstance(value, str) or not value.isprintable() else repr(value)
    return text if len(text) <= most else text[: most - 3] + "..."


def join_names(names: Iterable[str], most: int = 12) -> str:
    """Return the first `most` names for a message.

    Examples
    --------
    >>> join_names("abcd", most=2)
    'a, b, ... (4)'
    """
    names = list(names)
    return ", ".join(names[:most]) + (f", ... ({len(names)})" if len(names) > most else "")
