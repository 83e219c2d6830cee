"""Makes the made-up results of studies importable, here and in worker processes."""

import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from research import push_n

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "studies"))


@pytest.fixture(scope="session")
def entries_read_once() -> Iterator[None]:
    """The committed entries of push-n are read from their files once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(push_n, "committed_entries", cache(push_n.committed_entries))
        yield
