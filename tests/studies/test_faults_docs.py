"""research/notebooks/faults.md holds what the committed returns of the broken joint give."""

import json
import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
JOINTS = ("back foot", "back thigh", "fore foot", "fore thigh")


def test_a_broken_joint() -> None:
    page = (ROOT / "research" / "notebooks" / "faults.md").read_text(encoding="utf-8")
    rows = json.loads((ROOT / "examples" / "broken_joint.json").read_text(encoding="utf-8"))
    returns = {
        row["name"]: {way: np.array(row[way]) / 1000 for way in row if way[-1] == "y"}
        for row in rows
    }

    def level(name: str, way: str = "faulty", first: int = 5) -> str:
        return f"{returns[name][way][:, first : first + 5].mean():.2f}"

    for joint in JOINTS:
        names = (f"{policy}: {joint}" for policy in ("PPO", "PPO, longer", "PPO, relearned"))
        line = f"| {' | '.join(map(level, names))} |"
        assert re.search(rf"\| {joint} \|.*{re.escape(line)}\n", page), f"put in {line}"
        assert -0.29 <= float(level(f"random: {joint}")) <= -0.19
    sound = (level(f"{policy}: back foot", "healthy", 0) for policy in ("PPO", "PPO, longer"))
    assert f"| none | | | | | {' | '.join(sound)} | |\n" in page
