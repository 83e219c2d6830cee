"""A study and its store: opened to run what is left, and read back as a spec."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from ...core.interface.measures import Measure
from ...core.plugins.sources import FOLDER, kept_name
from ..spec.outline import sources_of
from ..spec.spec import Spec
from ..spec.toml import dumps
from ..store import integrity
from ..store.database import DATABASE, SPEC_FILE
from ..store.reading import Reading
from ..store.schema import Noted
from ..store.store import Store, locked
from . import code
from .refusal import examine, is_copy, noted_of
from .trial import Trial


@contextmanager
def open_to_run(
    directory: Path,
    spec: Spec,
    trials: Sequence[Trial],
    measures: Sequence[Measure],
    *,
    accept_code: bool = False,
) -> Iterator[Store]:
    """Open the store of a study in a directory; make it if it does not exist.

    Parameters
    ----------
    directory
        The directory.
    spec
        The study.
    trials
        All its trials.
    measures
        What it measures of its episodes, see `nested_agents.studies.trials.arrangement.check`.
    accept_code
        Whether to go on although the installed code has changed since.

    Raises
    ------
    SpecError
        If it cannot be written, holds a study that differs by more than additional seeds, or
        another process is writing to it. Nothing has been changed then.
    """
    noted = noted_of(spec, measures, trials)
    examine(directory, spec, noted, accept_code=accept_code)  # what is refused leaves nothing
    with locked(directory):
        # Again: nobody else writes from here on.
        damage = examine(directory, spec, noted, accept_code=accept_code)
        known = None
        if damage is None and integrity.holds_tables(directory / DATABASE):
            with Reading.open(directory) as reading:
                known = reading.code()
        computed = replace(noted, code=code.present(known))
        with Store.create(directory, computed, _files(directory, spec, noted), damage) as store:
            yield store


def _files(directory: Path, spec: Spec, noted: Noted) -> dict[str, bytes]:
    """Return the spec and the users' files, which are kept to be read and run again."""
    files = {}
    if not is_copy(directory / SPEC_FILE, spec, noted):
        files[SPEC_FILE] = dumps(spec.table()).encode()
    copies = spec.sources.texts.items()
    return files | {f"{FOLDER}/{kept_name(name)}": text.encode() for name, text in copies}


def spec_of(store: Reading) -> Spec:
    """Return the spec of a kept study; what it names of users' files is run."""
    return Spec.of(store.spec(), sources_of(store))


def pending(store: Store, trials: Iterable[Trial]) -> list[Trial]:
    """Return the trials that have neither failed nor finished with undamaged results.

    What is damaged is added to the store's `notes`.
    """
    states = store.states()
    return [trial for trial in trials if trial.identity not in states]
