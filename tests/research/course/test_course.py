"""The labs of the course run, on a smaller scale, and leave a slide of 16:9."""

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest

from labs import LABS

ROOT = Path(__file__).resolve().parents[3]
COURSE = ROOT / "research" / "course"
SMALLER = {
    "climbing-game": [
        ("SEEDS = 20", "SEEDS = 2"), ("episodes=5", "episodes=2"), ("steps=1000", "steps=20")
    ],
    "costs": [("LARGEST = 6", "LARGEST = 3")],
    "wheel-failure": [
        ("SEEDS, EPISODES, FAILS = 4, 20, 10", "SEEDS, EPISODES, FAILS = 2, 10, 5"),
        ("steps=120", "steps=4"),
    ],
    "own-hierarchy": [
        ("SEEDS, EPISODES = 6, 10", "SEEDS, EPISODES = 2, 1"), ("steps=120", "steps=4"),
        ("evaluation=5", "evaluation=1"),
    ],
}  # fmt: skip


def test_every_lab_has_a_program_and_slides_are_of_labs() -> None:
    programs = sorted(path.stem.replace("_", "-") for path in COURSE.glob("*.py"))
    assert programs == sorted([*LABS, "grade", "labs", "questions"])
    for slide in COURSE.glob("*.png"):
        assert slide.stem in LABS
        height, width, _ = plt.imread(slide).shape
        assert width / height == pytest.approx(16 / 9)


@pytest.mark.slow
@pytest.mark.parametrize("lab", LABS)
def test_a_lab_runs(
    lab: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code = (COURSE / f"{lab.replace('-', '_')}.py").read_text(encoding="utf-8")
    for usual, small in [*SMALLER[lab], ("jobs=2", "jobs=1")]:
        assert usual in code or usual == "jobs=2"
        code = code.replace(usual, small)
    with mpl.rc_context({"backend": "agg"}):
        exec(compile(code, lab, "exec"), {"__name__": "lab"})
        plt.close("all")
    asked = list(LABS[lab].questions)
    said = capsys.readouterr().out
    assert f"{lab}: 0 of {len(asked)}\n" in said
    assert [line.split()[0] for line in said.splitlines()[-len(asked) :]] == asked
    height, width, _ = plt.imread(tmp_path / "out" / "course" / f"{lab}.png").shape
    assert width / height == pytest.approx(16 / 9)
