"""The settings of a topology, as they stand in the ``[topology]`` table of a spec, or as a string.

A string is ``"kind"`` or ``"kind:argument"``, see `parse`; each settings class says what its
argument may be.
"""

from __future__ import annotations

from difflib import get_close_matches
from typing import Annotated, Any, ClassVar, Literal, Self, get_args

from pydantic import BeforeValidator, Field, ValidationError, model_validator
from typing_extensions import TypeAliasType

from ..core.refusals import rule
from ..core.settings import Fraction, Settings
from . import files

Count = Annotated[int, Field(ge=1)]
Names = tuple[str, ...]
Members = TypeAliasType("Members", "tuple[str | Members, ...]")


class TopologySettings(Settings):
    """What the settings of all topologies share: how a string is read."""

    argument: ClassVar[str] = ""
    """What may follow ``kind:`` in a string, for help texts; empty: nothing."""

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Return the settings that ``"kind:argument"`` stands for."""
        raise ValueError(f"takes no argument, received {argument!r}")

    @property
    def title(self) -> str:
        """What it is called in complaints."""
        return str(getattr(self, "kind", None))

    def check_unchanged(self) -> None:
        """Refuse if a file that the topology is made from is not what it was: one line."""


class ChainSettings(TopologySettings):
    """The paper's nested chain, from the first agent of `order` down to the last."""

    kind: Literal["chain"] = "chain"
    order: Literal["listed", "reversed", "interleaved"] | Names = "listed"
    """The agents' own order, its reverse, wheel by wheel across robots, or all names in order."""

    argument: ClassVar[str] = "reversed|interleaved|NAME,NAME,..."

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the order: a word, or all names separated by commas."""
        if argument in ("listed", "reversed", "interleaved"):
            return cls.model_validate({"order": argument})
        names = _names(argument)
        if not all(names):
            raise ValueError(f"order must be written a,b,c, received {argument!r}")
        return cls(order=names)


class TreeSettings(TopologySettings):
    """A tree in which every agent but the last ones has `branching` subordinates."""

    kind: Literal["tree"] = "tree"
    branching: Count = 2

    argument: ClassVar[str] = "BRANCHING"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the branching."""
        return cls(branching=_integer(argument, "branching"))


class StarSettings(TopologySettings):
    """One leader with everyone else right below it."""

    kind: Literal["star"] = "star"
    leader: str | None = None
    """None: the first agent."""

    argument: ClassVar[str] = "LEADER"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the leader's name."""
        return cls(leader=argument)


class TeamsSettings(TopologySettings):
    """Nested teams: the leaders of a team's members form a chain or a star.

    The leader of a team is that of its first member. Without `members`, the team is one of robots
    of wheels: the first wheels form a chain, each above its own robot's other wheels.
    """

    kind: Literal["teams"] = "teams"
    link: Literal["chain", "star"] = "chain"
    members: Members | None = None
    """Nested lists of agent names, to any depth; none: the groups (robots) of the scenario."""

    argument: ClassVar[str] = "star"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the link."""
        return cls.model_validate({"link": argument})


class IndependentSettings(TopologySettings):
    """Agents that do not see one another."""

    kind: Literal["independent"] = "independent"


class EdgesSettings(TopologySettings):
    """Any hierarchy, edge by edge."""

    kind: Literal["edges"] = "edges"
    edges: tuple[tuple[str, str], ...]
    """Pairs (superior, subordinate)."""
    alone: Names = ()
    """Agents in no edge."""

    argument: ClassVar[str] = "A>B,B>C,D"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read ``"a>b,b>c,d"``: edges, and agents that stand alone."""
        parts = [tuple(n.strip() for n in part.split(">")) for part in argument.split(",")]
        for part in parts:
            if len(part) > 2 or not all(part):
                raise ValueError(f"an edge must be written a>b, received {'>'.join(part)!r}")
        edges = tuple(part for part in parts if len(part) == 2)
        return cls.model_validate({"edges": edges, "alone": [p[0] for p in parts if len(p) == 1]})


class RandomSettings(TopologySettings):
    """A random hierarchy: each agent above each lower-ranked one with a chance."""

    kind: Literal["random"] = "random"
    seed: Annotated[int, Field(ge=0)] = 0
    density: Fraction = 0.3
    """Chance of each possible edge."""

    argument: ClassVar[str] = "SEED"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the seed."""
        return cls(seed=_integer(argument, "seed"))


class _OfAFile(TopologySettings):
    """What a file defines: results belong to the content that it has."""

    digest: str = ""
    """Hash of the file's content, filled in when missing."""

    key: ClassVar[str]
    """The setting that names the file."""

    @classmethod
    def digest_of(cls, named: str) -> str:
        """Return the hash of the present content of what is named."""
        return files.digest(named)

    @model_validator(mode="before")
    @classmethod
    def _fill_digest(cls, table: Any) -> Any:
        named = table.get(cls.key) if isinstance(table, dict) else None
        if isinstance(named, str) and not table.get("digest"):
            return {**table, "digest": cls.digest_of(named)}
        return table

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read what is named."""
        return cls.model_validate({cls.key: argument})

    @property
    def title(self) -> str:
        """What is named."""
        return str(getattr(self, self.key))

    def check_unchanged(self) -> None:
        """Refuse another content than the digest's."""
        if (found := self.digest_of(self.title)) != self.digest:
            raise ValueError(f"has changed: its digest is {found}, the settings say {self.digest}")


class FileSettings(_OfAFile):
    """A graph from a GraphML or JSON file."""

    kind: Literal["file"] = "file"
    path: str

    argument: ClassVar[str] = "PATH.graphml|PATH.json"
    key: ClassVar[str] = "path"


class PythonSettings(_OfAFile):
    """A user's function in a Python file."""

    kind: Literal["python"] = "python"
    source: str
    """``path/to/file.py:function``, see `nested_agents.topologies.files`."""

    argument: ClassVar[str] = "PATH.py:FUNCTION"
    key: ClassVar[str] = "source"

    @classmethod
    def digest_of(cls, named: str) -> str:
        """Return the hash of the file that holds the function."""
        return files.digest(files.split_source(named)[0])


class PackageSettings(_OfAFile):
    """A user's function in an installed package, by entry point."""

    kind: Literal["package"] = "package"
    name: str

    argument: ClassVar[str] = "NAME"
    key: ClassVar[str] = "name"

    @classmethod
    def digest_of(cls, named: str) -> str:
        """Return the hash of the file in which the package defines it."""
        return files.package_digest(named)


class SingleAgentSettings(TopologySettings):
    """No hierarchy: one agent over the joint state, with |A|^n actions (Eq. 23)."""

    kind: Literal["single-agent"] = "single-agent"


class PerRobotSettings(TopologySettings):
    """One agent per robot, driving all its wheels; these agents form a chain."""

    kind: Literal["per-robot"] = "per-robot"


AnyTopology = Annotated[
    ChainSettings
    | TreeSettings
    | StarSettings
    | TeamsSettings
    | IndependentSettings
    | EdgesSettings
    | RandomSettings
    | FileSettings
    | PythonSettings
    | PackageSettings
    | SingleAgentSettings
    | PerRobotSettings,
    Field(discriminator="kind"),
]


def parse(text: str) -> TopologySettings:
    """Read a topology from a string.

    Besides ``"kind"`` and ``"kind:argument"``, a graph file, a ``file.py:function`` and the name of
    an installed package's topology stand for themselves.

    Raises
    ------
    ValueError
        If the kind is unknown or its argument not allowed; one line.

    Examples
    --------
    >>> parse("tree:3"), parse("chain")
    (TreeSettings(kind='tree', branching=3), ChainSettings(kind='chain', order='listed'))
    """
    kind, colon, argument = text.partition(":")
    try:
        if kind in KINDS:
            model = KINDS[kind]
            return model.parsed(argument) if colon else model()
        if text.endswith((".graphml", ".json")):
            return FileSettings(path=text)
        if ".py:" in text:
            return PythonSettings(source=text)
        if text in files.installed():
            return PackageSettings(name=text)
    except ValidationError as error:
        raise ValueError(f"topology {text!r}: {_one_line(error)}") from None
    except ValueError as error:
        raise ValueError(f"topology {text!r}: {error}") from None
    known = [*KINDS, *files.installed()]
    near = get_close_matches(kind, known, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise ValueError(f"topology {text!r}: {hint}known: {', '.join(known)}, or a file")


def _from_text(value: object) -> object:
    return parse(value) if isinstance(value, str) else value


Topology = Annotated[AnyTopology, BeforeValidator(_from_text)]
"""Any topology's settings: a table told apart by `kind`, or a string for `parse`."""

KINDS: dict[str, type[TopologySettings]] = {
    model.model_fields["kind"].default: model for model in get_args(get_args(AnyTopology)[0])
}
"""The settings classes by kind."""


def _names(text: str) -> Names:
    return tuple(name.strip() for name in text.split(","))


def _integer(text: str, what: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{what} = {text!r}: must be a whole number") from None


def _one_line(error: ValidationError) -> str:
    problems = []
    for problem in error.errors():
        where, value = ".".join(str(part) for part in problem["loc"]), problem["input"]
        if problem["type"] == "missing":
            problems.append(f"{where}: missing")
        else:
            said = rule(problem["msg"])
            problems.append(f"{where} = {value!r}: {said}" if where else said)
    return "; ".join(problems)
