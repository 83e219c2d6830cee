"""Tables of predictions and free motion are those of the documentation."""

import re
import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_documented_prediction_errors_are_those_of_the_benchmark() -> None:
    benchmark = runpy.run_module("research.prediction_errors")
    count, means = benchmark["errors"](box="square")
    row = "| ".join(f"{mean:.1f} " for mean in means)
    documented = (DOCS.parent / "research" / "notebooks" / "dynamics_models.md").read_text(
        encoding="utf-8"
    )
    assert f"| square | {count} | {row}|" in documented


def test_calibrated_constants_predict_as_well_as_the_right_ones() -> None:
    benchmark = runpy.run_module("research.calibration")
    found, errors = benchmark["calibrated"]("e-puck", "too soft", 3)
    believed, calibrated, right = errors[20:].mean(axis=0)
    assert calibrated < 1.2 * right < 0.3 * believed
    assert abs(found[-1] - 1.0).max() < 0.3


def test_free_motion_agrees_with_the_theory_as_well_as_is_documented(
    capsys: pytest.CaptureFixture[str],
) -> None:
    runpy.run_module("research.free_motion", run_name="__main__")
    said = capsys.readouterr().out
    (ahead, yaw) = re.findall(
        r"within\s+(\S+)\s+mm/s\s+and\s+(\S+)\s+rad/s",
        (DOCS / "environments" / "box_pushing.md").read_text(encoding="utf-8"),
    )[0]
    rows = re.findall(r"^\| [\w-]+ \| (\S+) \| (\S+) \| (\S+) \| (\S+) \|$", said, re.MULTILINE)
    assert len(rows) == 12
    for row in rows:
        found, expected, turned, predicted = map(float, row)
        assert found == pytest.approx(expected, abs=float(ahead) + 1e-9)
        assert turned == pytest.approx(predicted, abs=float(yaw) + 1e-9)
    assert "delayed by 8: 20.48 mm less; theory 20.48 mm" in said
