"""The spec of a study, from a TOML file or from Python objects.

The tables ``[scenario]``, ``[topology]`` and ``[learner]`` override those of the preset. Conditions
are the combinations of ``[[overrides]]``, which are further tables by name, and ``[sweep]``, which
has lists of values by dotted key. ``[[curriculum]]`` has stages of training before that of the
conditions, ``[evaluations]`` further scenarios and hierarchies for the trained teams, and
``[tune]`` the values that `nested_agents.studies.api.tuning` tries.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, ValidationError, ValidationInfo, field_validator

from ...core.agents.joint import Granularity
from ...core.plugins.models import tuples
from ...core.plugins.problems import explain
from ...core.plugins.settings import Settings
from ...core.plugins.sources import Sources, is_reference, mentions
from ...core.plugins.trust import modules_in
from ...core.plugins.words import closest, expect
from ...topologies.names import join_names
from ..errors import SpecError, refused
from ..store.database import DATABASE, EVALUATION, SAMPLED, SPEC_FILE
from .conditions import Condition, Curriculum, Length, Name, Override
from .controls import LEARN_NOTHING, planning_remark, tuning_keys
from .objects import plain
from .presets import PRESETS
from .resolution import (
    UserTables,
    conditions_of,
    expand,
    expand_section,
    known_tables,
    sections_of,
)
from .studies import STUDIES
from .tables import SWEEP, SpecTable, TomlTable, assignment, flat, override, spec_text, table_of

MOST_TRIALS = 100_000
"""Maximum number of trials of a study."""

MOST_KEYS = 6
"""Maximum number of keys in a remark."""

Seed = Annotated[int, Field(ge=0, le=2**63 - 1)]


class Spec(Settings):
    """A study: its conditions, seeds and lengths.

    Examples
    --------
    >>> spec = Spec.of({"seeds": 3, "sweep": {"preset": ["default", "frozen"]}})
    >>> spec.seeds, [condition.label for condition in spec.conditions()]
    ((0, 1, 2), ['default', 'frozen'])

    Keywords work, too. Tables may hold settings, classes, functions and hierarchies:

    >>> from nested_agents.core.learners.td import TDLambdaSettings
    >>> ridges = [{"name": f"ridge {r}", "learner": {"ridge": r}} for r in (1.0, 100.0)]
    >>> online = {"name": "online", "learner": TDLambdaSettings(step_size=0.1, normalized=True)}
    >>> [c.label for c in Spec(overrides=[*ridges, online]).conditions()]
    ['ridge 1.0', 'ridge 100.0', 'online']
    """

    title: str | None = None
    """Title of the report. By default, the first sentence of the comment at the top of the file."""
    study: str = "learning-curve"
    """Name of the study: what is measured and how it is analyzed."""
    preset: str = "default"
    """Preset that the tables below override."""
    unset: tuple[str, ...] = ()
    """Dotted keys of the preset that return to their defaults, which TOML cannot write if they are
    none: ``unset = ["learner.rule_base.memberships"]``."""
    seeds: tuple[Seed, ...] = tuple(range(8))
    """List of seeds, or their number n for the seeds 0 to n - 1."""
    episodes: Length = 20
    """Number of training episodes of a trial."""
    decisions: Annotated[int, Field(ge=1, le=1_000_000_000)] | None = None
    """Joint decisions of training, counted over all environments. The study ``experience`` uses
    them instead of `episodes`."""
    steps: Length = 450
    """Maximum number of decisions in an episode."""
    evaluation: Annotated[int, Field(ge=0, le=1_000_000)] = 10
    """Number of evaluation episodes after training, without exploration and learning."""
    evaluation_steps: Length | None = None
    """Maximum number of decisions in an evaluation episode. By default, as in training."""
    keep_teams: bool = False
    """Whether trained teams are kept, so that they can act, be explained and be re-evaluated
    without training again."""
    scenario: SpecTable = Field(default_factory=dict)
    """Changes of the scenario of the preset."""
    agents: Granularity | None = None
    """Granularity: one agent per actuator (the default), per body, or for the team."""
    topology: SpecTable = Field(default_factory=dict)
    """Changes of the topology of the preset; may be written as a string."""
    learner: SpecTable = Field(default_factory=dict)
    """Changes of the learner of the preset."""
    sweep: Mapping[str, tuple[Any, ...]] = Field(default_factory=dict)
    """Lists of values by dotted key. The conditions are all their combinations."""
    tune: Mapping[str, tuple[Any, ...]] = Field(default_factory=dict)
    """Lists of values by dotted key for `nested-agents tune`."""
    overrides: tuple[Override, ...] = ()
    """Tables by name. Each overrides those above and is combined with the sweep."""
    curriculum: Curriculum = ()
    """Stages of training before `episodes`, in changed scenarios."""
    evaluations: Mapping[Name, SpecTable] = Field(default_factory=dict)
    """Further evaluations of the trained teams by name: changes of the scenario and, under
    ``topology`` and ``learner.decision``, of how they decide."""

    _conditions: tuple[Condition, ...] = PrivateAttr(default=())
    _sources: Sources = PrivateAttr(default_factory=Sources)

    @field_validator("study", "preset")
    @classmethod
    def _known(cls, value: str, info: ValidationInfo) -> str:
        is_study = info.field_name == "study"
        known = STUDIES.names() if is_study else PRESETS
        if is_study and is_reference(value):
            STUDIES.find(value)
        elif value not in known:
            moved = STUDIES.moved.get(value) if is_study else None
            raise ValueError(moved or closest(value, known))
        return value

    @field_validator("evaluations")
    @classmethod
    def _not_taken(cls, value: Mapping[str, SpecTable]) -> Mapping[str, SpecTable]:
        taken = SAMPLED.removeprefix(EVALUATION)
        if taken in value:
            raise ValueError(
                f"{taken!r} is the evaluation of stochastic policies, use another name"
            )
        return value

    @field_validator("seeds", mode="before", json_schema_input_type=int | tuple[Seed, ...])
    @classmethod
    def _count(cls, value: object) -> object:
        if isinstance(value, int) and not isinstance(value, bool):
            if not 1 <= value <= MOST_TRIALS:
                raise ValueError(f"must be between 1 and {MOST_TRIALS}, or a list of seeds")
            return tuple(range(value))
        if not isinstance(value, list | tuple | range):
            raise ValueError("must be a whole number or a list of whole numbers")
        if not 1 <= len(value) <= MOST_TRIALS:
            raise ValueError(f"must be a list of 1 to {MOST_TRIALS} seeds")
        if len(set(map(repr, value))) < len(value):
            raise ValueError("must be a list of distinct seeds")
        return tuple(value)

    @classmethod
    def made(cls, **table: Any) -> Spec:
        """Return the spec of keywords, see `of`."""
        return cls.of(table)

    @classmethod
    def of(cls, table: SpecTable, sources: Sources | None = None) -> Spec:
        """Build a spec from a table as TOML reads it, or with objects in it.

        Parameters
        ----------
        table
            The spec. It may hold settings, classes and functions instead of names.
        sources
            The files that it may name; those below the working directory unless given.

        Raises
        ------
        SpecError
            If anything in it, the conditions included, is wrong.
        """
        sources = Sources(Path()) if sources is None else sources
        try:
            with sources.active():
                return cls._of(table, sources)
        except RecursionError:
            raise SpecError("spec: is nested too deeply") from None
        except SpecError:
            raise
        except ValueError as error:  # a number of more digits than Python writes
            raise SpecError(f"spec: {error}") from None

    @classmethod
    def _of(cls, table: SpecTable, sources: Sources) -> Spec:
        table = expand(plain(table), "")
        if isinstance(table.get("overrides"), list | tuple):
            table["overrides"] = tuple(
                expand(override, f"overrides[{i}].") if isinstance(override, Mapping) else override
                for i, override in enumerate(table["overrides"])
            )
        try:
            spec = cls.model_validate(tuples(table), strict=True)
        except ValidationError as error:
            raise SpecError(explain(error, cls, table, known_tables(table), SWEEP)) from None
        own = [override.sweep for override in spec.overrides] or [{}]
        points = sum(math.prod(map(len, {**swept, **spec.sweep}.values())) for swept in own)
        if points * len(spec.seeds) > MOST_TRIALS:
            grid_size = f"{points} conditions x {len(spec.seeds)} seeds"
            raise SpecError(f"sweep: {grid_size}, at most {MOST_TRIALS} trials")
        spec._conditions = conditions_of(
            UserTables(
                spec.preset,
                spec.unset,
                sections_of(spec),
                spec.sweep,
                spec.overrides,
                spec.evaluations,
                spec.curriculum,
            )
        )
        if spec.decisions is not None and [c.label for c in spec._conditions] == ["default"]:
            (only,) = spec._conditions
            spec._conditions = (only._replace(label=only.settings.learner.kind),)
        tables = [table for condition in spec._conditions for table in condition.tables]
        names = dict(mentions([{"study": spec.study}, *tables]))
        for name, key in names.items():
            try:
                sources.text(name)
            except ValueError as error:
                problem = str(error).removeprefix(f"{name}: ")
                raise SpecError(f"{key} = {name!r}: {problem}") from None
        for module, key in dict(modules_in(tables)).items():
            with refused(f"{key}: "):
                sources.permit(module)
        data_files = {name for name in sources.texts if name.endswith(".csv")}
        spec._sources = sources.only({*names, *data_files})
        spec._check_decisions()
        return spec

    def _check_decisions(self) -> None:
        """Refuse a budget in decisions where a study counts episodes, and the other way round."""
        if (
            self.decisions is not None
            and self.study != "experience"
            and self.study in STUDIES.names()
        ):
            raise SpecError(
                f"decisions = {self.decisions}: {self.study} counts episodes, allowed where study "
                "= 'experience'"
            )
        for condition in self._conditions:
            environments = condition.settings.learner.n_environments
            if environments > 1 and self.decisions is None:
                raise SpecError(
                    f"learner.environments = {environments}: needs a budget in "
                    f"decisions, study = 'experience' with decisions = "
                    f"1000000 (condition {condition.label!r})"
                )

    @classmethod
    def read(cls, spec: Spec | SpecTable | str | PathLike[str], study: Path | None = None) -> Spec:
        """Return the spec that a table or the path of a TOML file stands for; see `of`, `load`."""
        expect("a Spec, a table or the path of a file", Spec | Mapping | str | PathLike, spec=spec)
        given = cls.of(spec) if isinstance(spec, Mapping) else spec
        return given if isinstance(given, Spec) else cls.load(given, study=study)

    @classmethod
    def load(
        cls, path: str | PathLike[str], changes: Sequence[str] = (), study: Path | None = None
    ) -> Spec:
        """Read a TOML file and apply ``key=value`` changes.

        Files of users are searched for in its folder, then among the copies of a study. The copy of
        a spec in the folder of a study may come from another person, see `trust`.

        Raises
        ------
        SpecError
            If the file cannot be read, is no TOML, or anything in it is wrong.
        """
        path = Path(path)
        text = spec_text(path)
        is_copy = path.name == SPEC_FILE and (path.parent / DATABASE).exists()
        brought_by = str(path.parent) if is_copy else None
        sources = Sources(path.parent, study=study, brought_by=brought_by)
        return cls.parse(text, changes, str(path), sources)

    @classmethod
    def parse(
        cls,
        text: str,
        changes: Sequence[str] = (),
        title: str = "spec",
        sources: Sources | None = None,
    ) -> Spec:
        """Read TOML text and apply ``key=value`` changes; see `load`, `of`.

        Messages call the text by its `title`.
        """
        try:
            table = table_of(text, title)
            for change in changes:
                with refused(f"--set {change}: "):
                    table = _changed(table, assignment(change))
            _check_effects(changes, table.get(SWEEP))
        except RecursionError:
            raise SpecError(f"{title}: is nested too deeply") from None
        return cls.of(table, sources)

    def conditions(self) -> tuple[Condition, ...]:
        """Return the conditions in the order of the overrides and sweeps."""
        return self._conditions

    def model_copy(self, *, update: SpecTable | None = None, deep: bool = False) -> Spec:
        """Return a spec with some fields changed, and the conditions that then follow."""
        return Spec.of({**self.table(), **(update or {})}, self.sources)

    def warnings(self) -> tuple[str, ...]:
        """Return a line for each suspicious value and each ignored key.

        Ignored are keys of the learner in controls, and of the topology for learners without
        hierarchy.
        """
        lines = [*self._of_controls()]
        for condition in self.conditions():
            lines += condition.settings.warnings()
            lines += condition.settings.remarks()
            stages = (stage.scenario for stage in condition.curriculum)
            for scenario in (*(own.scenario for own in condition.labeled.values()), *stages):
                lines += scenario.warnings()
        return tuple(dict.fromkeys(lines))

    def _of_controls(self) -> Iterator[str]:
        """Yield what is left out for controls, and what must be said of them, a line each."""
        controls = [c for c in self.conditions() if c.settings.learner.kind in LEARN_NOTHING]
        labels = join_names((condition.label for condition in controls), MOST_KEYS)
        tuned = tuning_keys([*(f"learner.{key}" for key in self.learner), *self.sweep])
        tuned = [key for key in tuned if key != "learner.kind"]
        if tuned and controls:
            learn = "learns" if len(controls) == 1 else "learn"
            yield f"{', '.join(tuned)}: left out for {labels}, which {learn} nothing"
        for control in controls:
            if control.same:
                others = join_names(map(repr, control.same), MOST_KEYS)
                yield (
                    f"{others}: left out, the same control as {control.label!r}; to have both, "
                    "give it another learner.decision or scenario"
                )
        tables = {c.label: c.settings.model_dump(mode="json") for c in self.conditions()}
        remark = planning_remark(tables)
        if remark is not None:
            yield remark

    @property
    def sources(self) -> Sources:
        """Files of users that the spec names."""
        return self._sources

    def table(self) -> TomlTable:
        """Return the spec as a table that `of` reads back."""
        table = _filled(self.model_dump())
        table["overrides"] = [
            _filled({**override, "unset": override["unset"] or None})
            for override in table.get("overrides", ())
        ]
        if self.seeds == tuple(range(len(self.seeds))):
            table["seeds"] = len(self.seeds)
        if not self.keep_teams:
            del table["keep_teams"]
        return {key: value for key, value in table.items() if value not in ([], ())}


def _check_effects(changes: Sequence[str], sweep: object) -> None:
    """Refuse changes of keys that the spec sweeps."""
    swept = dict(flat(sweep)) if isinstance(sweep, Mapping) else {}
    for change in changes:
        if key := next((key for key, _ in flat(assignment(change)) if key in swept), None):
            raise SpecError(
                f"--set {change}: has no effect, because the spec sweeps {key}; "
                f"set {SWEEP}.{key}, a list of values"
            )


def _changed(table: TomlTable, change: TomlTable) -> TomlTable:
    """Return a changed table; a topology written as text becomes a table if a key of it changes.

    Keys of a sweep may be quoted or not: ``sweep."topology.kind"`` is ``sweep.topology.kind``.
    """
    topology = table.get("topology")
    if isinstance(topology, str) and isinstance(change.get("topology"), Mapping):
        table = {**table, "topology": expand_section("topology", topology)}
    swept, changed = table.get(SWEEP), change.get(SWEEP)
    if isinstance(swept, Mapping) and isinstance(changed, Mapping):
        keys = [key for key, _ in flat(swept)]
        if len({*keys}) == len(keys):  # else the spec is refused
            return {**table, SWEEP: dict(flat(swept)) | dict(flat(changed))}
    return override(table, change)


def _filled(table: TomlTable) -> TomlTable:
    return {key: value for key, value in table.items() if value not in ({}, None)}
