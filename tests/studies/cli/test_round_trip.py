"""Every exported file of every installed study is read to the verdict of the study itself."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import made_up
import pandas as pd
import pytest

import nested_agents as na
from nested_agents.studies import catalogue
from nested_agents.studies.api.study import StudyResults
from nested_agents.studies.catalogue.study import load_study
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.studies import NAMES
from nested_agents.studies.trials.trial import Trial, TrialResult, trials_of
from nested_agents.studies.workers.runner import save

FILES = {
    "csv": "episodes.csv",
    "parquet": "episodes.parquet",
    "json": "results.json",
    "marl-eval": "marl-eval.json",
}
DECISIONS = 5


def spec_of(study: str) -> Spec:
    """Return the spec of a study of the catalogue with few conditions, seeds and episodes."""
    name = study.replace("-", "_")
    path = Path(catalogue.__file__).parent / name / f"{name}.toml"
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    table |= {"seeds": 5, "steps": 5}
    if study != "wheel-failure":  # whose failure begins in episode 20
        table |= {"episodes": 6}
    if study == "experience":
        table |= {"decisions": 10_000}
    return Spec.of(table)


def measured(trial: Trial) -> TrialResult:
    """Return made-up results; a study by decisions has fewer episodes with some seeds."""
    result = made_up.measure(trial)
    if trial.study == "experience":
        kept = DECISIONS - trial.seed % 3
        rows = [row for row in result.rows if row.phase != "training" or row.episode < kept]
        result = replace(result, rows=tuple(rows), numbers={"decisions": 10_000.0})
    if trial.study == "wheel-failure":
        result = replace(result, numbers={"onset": 20.0})
    return result


@pytest.fixture(scope="module", params=NAMES)
def study(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study two of whose trials failed, with all its exported files."""
    directory = tmp_path_factory.mktemp(request.param) / "out"
    spec = spec_of(request.param)
    first, *others = trials_of(spec)
    with made_up.opened(directory, spec) as store:
        for trial in others[:-1]:
            save(store, trial, measured(trial), 2.5)
        for trial in (first, others[-1]):
            store.fail(trial, "Traceback\nRuntimeError: a wheel came off\n")
    return directory


def verdict(study: StudyResults, **options: str) -> str:
    """Return the table and the verdicts of a comparison."""
    compared = study.compare(**options).analysis
    return "\n".join([str(tabulate(compared.table)), *compared.notes])


def shown(study: StudyResults) -> str:
    """Return the table of a study, or why there is none."""
    try:
        return str(study.table())
    except SpecError as error:
        return str(error)


@pytest.mark.parametrize("form", FILES)
def test_exported_files_give_the_verdict_of_the_study(study: Path, form: str) -> None:
    assert main(["export", str(study), "--format", form]) == 0
    kept, read = na.load(study), na.load(study / "export" / FILES[form])
    names = {kept.results.main.name, "steps"}
    names |= {"final_distance_m"} & {m.name for m in read.results.measures}
    for phase in kept.results.phases:
        for name in names:
            expected = verdict(kept, measure=name, phase=phase)
            assert verdict(read, measure=name, phase=phase) == expected
    usual = {"measure": kept.results.main.name} if form == "marl-eval" else {}  # has no failures
    assert verdict(read) == verdict(kept, **usual)


def test_exported_trials_give_the_verdict_of_the_study(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(study), "--out", str(tmp_path)]) == 0
    kept = na.load(study)
    expected = kept.compare(measure="seconds.total")
    comparison = na.load(tmp_path / "trials.csv").compare(measure="seconds.total")
    assert comparison.analysis.notes == expected.analysis.notes
    assert "2 of" in comparison.remarks[0]
    with pytest.raises(SpecError, match=r"measure = 'success': known: .*seconds\.total"):
        na.load(tmp_path / "trials.csv").compare(measure="success")
    with pytest.raises(SpecError, match=r"^measure: name one.* seconds\.total"):
        na.load(tmp_path / "trials.csv").compare()
    assert main(["table", str(tmp_path / "trials.csv")]) == 2
    assert "needs episodes" in capsys.readouterr().err
    numbers = load_study(kept.outline.study).NUMBERS
    path = tmp_path / "episodes.csv"
    assert shown(na.load(path)) == shown(kept)
    assert shown(na.load(path, tmp_path / "trials.csv")) == shown(kept)
    (tmp_path / "trials.csv").unlink()
    assert main(["table", str(path)]) == (2 if numbers else 0)
    assert ("--as learning-curve" in capsys.readouterr().err) == bool(numbers)
    assert ("--as learning-curve" in str(na.load(path))) == bool(numbers)
    assert main(["table", str(path), "--as", "learning-curve"]) == 0


def test_a_pattern_may_name_the_description_too(study: Path, tmp_path: Path) -> None:
    assert main(["export", str(study), "--out", str(tmp_path), "--format", "marl-eval"]) == 0
    files = sorted(tmp_path.iterdir())
    assert [file.name for file in files] == ["marl-eval.json", "study.json"]
    assert verdict(na.load(*files)) == verdict(na.load(files[0]))
    with pytest.raises(SpecError, match=r"study\.json: holds no results.* marl-eval\.json"):
        na.load(files[1])


def test_the_order_of_rows_and_columns_does_not_matter(study: Path, tmp_path: Path) -> None:
    assert main(["export", str(study), "--out", str(tmp_path)]) == 0
    path = tmp_path / "episodes.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    shuffled = table.sample(frac=1.0, random_state=1)[[*reversed(table.columns)]]
    shuffled.to_csv(path, index=False)
    assert verdict(na.load(path)) == verdict(na.load(study))


def test_a_changed_table_and_an_older_version_are_told(study: Path, tmp_path: Path) -> None:
    for form in ("csv", "marl-eval"):
        assert main(["export", str(study), "--out", str(tmp_path), "--format", form]) == 0
    assert not na.load(tmp_path / "episodes.csv").remarks
    path, header = tmp_path / "episodes.csv", tmp_path / "study.json"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    assert any("changed since" in remark for remark in na.load(path).remarks)
    table = json.loads(header.read_text()) | {"results_version": 1}
    header.write_text(json.dumps(table))
    for name in ("episodes.csv", "trials.csv", "marl-eval.json"):
        remarks = na.load(tmp_path / name).remarks
        assert any("results of version 1" in remark for remark in remarks)


def test_damage_of_a_parquet_file_is_refused_or_of_no_value(study: Path, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="extra [parquet]")
    assert main(["export", str(study), "--out", str(tmp_path), "--format", "parquet"]) == 0
    path = tmp_path / "trials.parquet"
    content = path.read_bytes()
    expected = na.load(path).trials
    footer = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
    refused = 0
    for place in (*range(4, footer, 397), *range(footer, len(content), 1201)):
        damaged = bytearray(content)
        damaged[place] ^= 1
        path.write_bytes(damaged)
        try:
            read = na.load(path).trials
        except SpecError:
            refused += 1
        else:
            assert place > footer or read.set_axis(expected.columns, axis=1).equals(expected)
    assert refused


def test_a_missing_column_is_told(study: Path, tmp_path: Path) -> None:
    assert main(["export", str(study), "--out", str(tmp_path)]) == 0
    path = tmp_path / "episodes.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    table.drop(columns="final_distance_m").to_csv(path, index=False)
    assert any("no column final_distance_m" in remark for remark in na.load(path).remarks)


def test_a_table_without_its_description_is_refused_unless_columns_are_named(
    study: Path, tmp_path
) -> None:
    assert main(["export", str(study), "--out", str(tmp_path)]) == 0
    (tmp_path / "study.json").unlink()
    path = tmp_path / "episodes.csv"
    with pytest.raises(SpecError, match=r"episodes\.csv: .*no study\.json"):
        na.load(path)
    read = na.load(path, columns=["score=success,seed=seed,item=episode"])
    first, phase = read.conditions[0], read.results.phases[0]
    measured = read.results.means(first, phase)
    kept = na.load(study).results.means(first, phase)
    assert measured.tolist() == kept.tolist()


def test_mixed_swept_values_are_written_and_read(tmp_path: Path, capsys) -> None:
    pytest.importorskip("pyarrow", reason="extra [parquet]")
    spec = Spec.of(
        {
            "seeds": 3, "episodes": 1, "steps": 2, "evaluation": 1, "preset": "random",
            "overrides": [
                {"name": "a", "sweep": {"scenario": {"box": ["square", "disc"]}}},
                {"name": "b", "sweep": {"scenario": {"robots": [2, 3]}}},
            ],
        }
    )  # fmt: skip
    with made_up.opened(tmp_path / "out", spec) as store:
        for trial in trials_of(spec):
            save(store, trial, made_up.measure(trial), 1.0)
    for form, name in FILES.items():
        assert main(["export", str(tmp_path / "out"), "--format", form]) == 0
        read = na.load(tmp_path / "out" / "export" / name)
        assert verdict(read) == verdict(na.load(tmp_path / "out"))
