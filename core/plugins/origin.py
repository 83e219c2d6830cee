"""Origin of classes and functions that a text names: the file or package that defines them."""

from collections.abc import Callable
from inspect import isfunction
from typing import Any

from .sources import file_of_module
from .trust import module_named


def checked_origin(
    reference: str, thing: object, kind: str, *bases: type
) -> Callable[..., Any] | type:
    """Return the function or class that a reference finds, if it may be called.

    A trusted file may import ``subprocess``, which must not make ``mine.py:subprocess.run`` a
    topology.

    Parameters
    ----------
    reference
        ``"file.py:Name"``, ``"package.module:Name"``, or the name of an entry point, which may
        refer to any function or class.
    thing
        What it refers to.
    kind
        Word for what it should be, for the message.
    bases
        Classes with subclasses that are allowed wherever they are defined.

    Raises
    ------
    ValueError
        If it is not a function or class, or is defined elsewhere and not a subclass of `bases`.
    """
    if not (isinstance(thing, type) or isfunction(thing)):
        raise ValueError(f"is of type {type(thing).__name__}, allowed: {kind}")
    if ":" not in reference or (isinstance(thing, type) and issubclass(thing, bases)):
        return thing
    module = module_named(reference)
    if module:
        is_own = thing.__module__.partition(".")[0] == module.partition(".")[0]
    else:
        is_own = file_of_module(thing.__module__) == reference.rpartition(":")[0]
    if not is_own:
        raise ValueError(
            f"is defined in {thing.__module__}; allowed: {kind} that the named file or package "
            "defines"
        )
    return thing
