"""The trials of all committed specs are the ones that they were, so that kept studies go on.

``identities.toml`` has a digest of the identities of the trials of each spec. One that is meant to
change, with `RESULTS_VERSION` or a spec, is written anew:
``./dev exec python tests/studies/catalogue/test_identities.py``.
"""

import hashlib
import tomllib
from collections.abc import Iterator
from pathlib import Path

import tomli_w

from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of

ROOT = Path(__file__).resolve().parents[3]
COMMITTED = Path(__file__).with_name("identities.toml")


def specs() -> Iterator[tuple[str, Spec]]:
    """Yield the specs in the repository, by path, but for those that name files of Python.

    The meaning of these differs between versions of Python.
    """
    for folder in ("studies", "research", "examples"):
        for path in sorted((ROOT / folder).rglob("*.toml")):
            try:
                spec = Spec.load(path)
            except SpecError:
                continue  # a table of something else
            if not spec.sources.texts:
                yield path.relative_to(ROOT).with_suffix("").as_posix(), spec


def digests() -> dict[str, str]:
    """Return a digest of the identities of the trials of every spec, by path."""
    result = {}
    for name, spec in specs():
        identities = " ".join(trial.identity for trial in trials_of(spec))
        result[name] = hashlib.sha256(identities.encode()).hexdigest()[:16]
    return result


def test_the_trials_of_all_committed_specs_are_the_ones_that_they_were() -> None:
    here = set(digests().values())  # wherever a spec has been moved to
    committed = tomllib.loads(COMMITTED.read_text())
    assert [name for name, digest in committed.items() if digest not in here] == []
    assert len(committed) > 100


if __name__ == "__main__":
    COMMITTED.write_text(tomli_w.dumps(digests()))
