"""What pytest leaves out: examples in modules that need an extra which is not installed."""

import gc
from importlib.util import find_spec

NEEDED = {
    "torch": "nested_agents/core/networks/*.py",
    "mujoco": "nested_agents/scenarios/swimmers.py",
}
collect_ignore_glob = [pattern for extra, pattern in NEEDED.items() if not find_spec(extra)]


def pytest_collection_finish() -> None:
    """Keep what has been imported and collected out of every later garbage collection."""
    gc.freeze()
