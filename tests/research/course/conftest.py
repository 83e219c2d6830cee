"""Makes the programs of the course importable, as they are to each other."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "research" / "course"))
