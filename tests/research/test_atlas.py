"""The atlas: rows of trials, laws of small teams tested on large ones, and the committed rows."""

import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from programs import main

from nested_agents.core.numerics import pd
from nested_agents.studies.spec.spec import Spec
from research import SPECS
from research import atlas_faults as faults
from research import atlas_predictions as predictions
from research import atlas_rows as atlas

pytest.importorskip("pyarrow")


def rows_of(fault: str = "", seeds: int = 5) -> pd.DataFrame:
    """Return rows of two hierarchies at 2 to 64 agents."""
    rng = np.random.default_rng(0)
    lines = []
    for hierarchy, size, seed in product(("chain", "star"), (2, 4, 8, 16, 32, 64), range(seeds)):
        steps = 10.0 * size**0.5 * float(np.exp(rng.normal(0.0, 0.05)))
        success = (0.9 if hierarchy == "chain" else 0.5) + 0.05 * rng.uniform()
        team = ("line_up", hierarchy, "batch-td", fault or atlas.NO_FAULT)
        lines.append((*team, size, seed, 20, success, steps))
    names = [*atlas.TeamKind._fields, "size", "seed", "episodes", "success", "steps"]
    return pd.DataFrame(lines, columns=names)


def test_laws_of_small_teams_meet_large_ones() -> None:
    checked = [check for check in predictions.checks(rows_of()) if check.measure == "steps"]
    assert [check.size for check in checked] == [32, 64, 32, 64]
    assert {check.law for check in checked} == {"power law"}
    inside = sum(check.is_inside for check in checked)
    assert inside >= 3
    assert predictions.coverage(checked)[0].startswith(f"all: {inside} of 4 inside, 2 laws, share ")


def test_a_law_that_does_not_go_on_is_found_out() -> None:
    rows = rows_of()
    rows.loc[rows["size"] == 64, "steps"] *= 10.0
    inside = {c.size: c.is_inside for c in predictions.checks(rows) if c.measure == "steps"}
    assert inside == {32: True, 64: False}


def test_what_losing_messages_costs_is_paired_by_seed() -> None:
    lost = rows_of(fault="lost 0.3")
    lost["success"] -= 0.2 + 0.01 * lost["seed"]
    lines = faults.fault_costs(pd.concat([rows_of(), lost]))
    assert len(lines) == 2
    assert all(float(one.difference.value) == pytest.approx(-0.22) for one in lines)
    assert str(lines[0]).startswith(
        "line_up, chain, batch-td, 64 agents, lost 0.3: success -0.22 ["
    )


def test_rows_of_two_studies_are_not_taken_for_one() -> None:
    with pytest.raises(ValueError, match="not unique"):
        faults.fault_costs(pd.concat([rows_of(), rows_of(), rows_of(fault="lost 0.3")]))


def test_thresholds_are_between_shares_that_were_run() -> None:
    frames = [rows_of()]
    for share, cost in ((0.2, 0.0), (0.5, 0.3)):
        failing = rows_of(fault=f"lost {share}")
        failing["success"] -= cost - 0.02 * (failing["seed"] - 2.0)
        frames.append(failing)
    first, *_ = faults.thresholds(faults.fault_costs(pd.concat(frames)))
    head, _, text = first.partition(": ")
    assert head == "line_up, chain, batch-td, 64 agents, messages lost"
    assert text == "costs from 0.50 on, not up to 0.20"


def test_committed_rows_are_made_again_from_published_ones() -> None:
    committed = pd.read_parquet(atlas.COMMITTED / f"{atlas.ALREADY}.parquet")
    pd.testing.assert_frame_equal(committed, atlas.published_rows())


@pytest.mark.parametrize("spec", sorted((SPECS / "atlas").glob("*.toml")), ids=lambda p: p.stem)
def test_names_of_conditions_are_hierarchy_learner_and_fault(spec: Path) -> None:
    for condition in Spec.load(spec).conditions():
        parts = str(condition.columns["name"]).split(", ")
        assert len(parts) in (2, 3)
        assert len([key for key in condition.columns if key in atlas.SIZES]) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--jobs", "2"], "--jobs: needs --out"),
        (["--rows", "nowhere"], "nowhere: holds no rows of the atlas"),
        (["--out", "there", "--task", "arm"], "--task = 'arm': did you mean 'arms'?"),
    ],
)
def test_bad_input(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["atlas", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_the_command_prints_what_the_page_says(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["atlas"]) == 0
    page = Path(__file__).resolve().parents[2] / "research" / "notebooks" / "atlas.md"
    out = capsys.readouterr().out.strip()
    text = page.read_text(encoding="utf-8")
    assert out in text
    (laws, share), *_ = re.findall(r"^all: .* inside, (\d+) laws, share (.*\]);", out, re.MULTILINE)
    assert f"in {share} of {laws} laws" in " ".join(text.split())
    counts = re.findall(
        r"^(?:decided and right|the greatest prediction): .*, (.*\])$", out, re.MULTILINE
    )
    assert all(count in text.split("```")[-3] for count in counts[-2:])


def test_the_page_has_the_law_of_decisions_to_success(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [
        "fit",
        str(atlas.RESULTS / "scaling.json"),
        "--criterion",
        "0.8",
        "--predict",
        "32",
    ]
    assert main(arguments) == 0
    page = Path(__file__).resolve().parents[2] / "research" / "notebooks" / "atlas.md"
    shown = capsys.readouterr().out.splitlines()
    text = page.read_text(encoding="utf-8")
    assert all(line.rstrip() in text for line in shown)
