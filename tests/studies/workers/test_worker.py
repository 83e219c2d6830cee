"""A trial fails with its traceback, whatever the user's code raises."""

import made_up
import pytest

from nested_agents.studies.cli.main import main
from nested_agents.studies.store.store import Store
from nested_agents.studies.workers.runner import MOST_ERROR, attempt


class OddError(BaseException):
    pass


@pytest.mark.parametrize(
    "raised", [SystemExit(0), SystemExit(3), KeyboardInterrupt(), OddError("odd")]
)
def test_what_is_no_exception_fails_a_trial_too(raised: BaseException) -> None:
    def measure(trial):
        raise raised

    arrival = attempt(measure, made_up.TRIALS[0])
    assert arrival.result is None
    assert type(raised).__name__ in arrival.error.splitlines()[-1]


@pytest.mark.parametrize("message", ["\ud800 alone", "long " * 600_000])
def test_any_message_can_be_stored_and_is_short(tmp_path, message: str) -> None:
    def measure(trial):
        raise ValueError(message)

    arrival = attempt(measure, made_up.TRIALS[0])
    assert len(arrival.error.encode()) < 2 * MOST_ERROR
    with made_up.opened(tmp_path) as store:
        store.fail(arrival.trial, arrival.error)
        assert len(store.failed()) == 1


QUITS = """
import sys
from nested_agents.scenarios.line_up import LineUp, LineUpSettings

class Settings(LineUpSettings):
    when: str = "step"

class Quits(LineUp):
    Settings = Settings

    def __init__(self, settings):
        super().__init__(settings)
        self.when = settings.when
        if self.when == "begin":
            sys.exit(0)
        if self.when == "error":
            raise TypeError("no speeds")

    def step(self, joint_action):
        sys.exit(0)
"""


def spec(tmp_path, when: str) -> str:
    (tmp_path / "quits.py").write_text(QUITS)
    (tmp_path / "spec.toml").write_text(
        f"""
        seeds = 2
        episodes = 1
        steps = 2
        evaluation = 1
        [[overrides]]
        name = "quits"
        scenario = {{ kind = "quits.py:Quits", when = "{when}" }}
        [[overrides]]
        name = "works"
        scenario = {{ kind = "line-up" }}
        """
    )
    return str(tmp_path / "spec.toml")


def test_a_scenario_that_quits_fails_its_trials_and_no_others(tmp_path, capsys) -> None:
    study = tmp_path / "study"
    assert main(["run", spec(tmp_path, "step"), "--out", str(study), "--jobs", "1"]) == 1
    assert "SystemExit: 0" in capsys.readouterr().err
    with Store.open(study) as store:
        assert store.counts() == {"done": 2, "failed": 2}


@pytest.mark.parametrize(
    ("when", "raised"),
    [
        ("begin", "raises SystemExit: 0 in line 15 of"),
        ("error", "raises TypeError: no speeds in line 17 of"),
    ],
)
def test_a_scenario_that_cannot_be_built_is_refused_in_one_line(
    tmp_path, capsys, when: str, raised: str
) -> None:
    assert main(["run", spec(tmp_path, when), "--out", str(tmp_path / "study")]) == 2
    error = capsys.readouterr().err
    assert raised in error
    assert error.count("\n") == 1
    assert not (tmp_path / "study").exists()


RAISES = {
    "raise RuntimeError('no power')": "RuntimeError: no power in line 7 of raises.py",
    "{}['power']": "KeyError: 'power' in line 7 of raises.py",
    "raise Mute": "Mute: in line 7 of raises.py",
    "return 0": "TypeError: __init__() should return None, not 'int'",
}
BUILT = """from nested_agents.scenarios.line_up import LineUp, LineUpSettings
class Mute(Exception):
    def __str__(self): raise RuntimeError
class Raises(LineUp):
    def __init__(self):
        super().__init__(LineUpSettings())
        {}
"""


@pytest.mark.parametrize("act", RAISES)
def test_whatever_a_scenario_raises_when_it_is_built_is_one_line(act, tmp_path, capsys) -> None:
    (tmp_path / "raises.py").write_text(BUILT.replace("{}", act, 1))
    spec = tmp_path / "spec.toml"
    spec.write_text('[scenario]\nkind = "raises.py:Raises"\n')
    assert main(["run", str(spec), "--out", str(tmp_path / "study")]) == 2
    error = capsys.readouterr().err
    assert f"scenario 'raises.py:Raises' raises {RAISES[act]}" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize(
    ("act", "status", "line"),
    [
        ("raise ValueError('no power')", 2, "error: no power, in line 7 of raises.py"),
        ("raise KeyboardInterrupt", 130, "interrupted in line 7 of raises.py"),
    ],
)
def test_its_own_words_and_an_interruption_have_their_line(
    act, status, line, tmp_path, capsys
) -> None:
    (tmp_path / "raises.py").write_text(BUILT.replace("{}", act, 1))
    spec = tmp_path / "spec.toml"
    spec.write_text('[scenario]\nkind = "raises.py:Raises"\n')
    assert main(["run", str(spec), "--out", str(tmp_path / "study")]) == status
    assert capsys.readouterr().err == f"nested-agents: {line}\n"
    assert not (tmp_path / "study").exists()


def test_what_a_scenario_raises_on_being_asked_is_one_line_too(tmp_path, capsys) -> None:
    text = BUILT.replace("{}", "pass", 1) + "    measures = property(lambda self: 1 / 0)\n"
    (tmp_path / "raises.py").write_text(text)
    spec = tmp_path / "spec.toml"
    spec.write_text('[scenario]\nkind = "raises.py:Raises"\n')
    assert main(["run", str(spec), "--out", str(tmp_path / "study")]) == 2
    error = capsys.readouterr().err
    assert "raises ZeroDivisionError: division by zero in line 8 of raises.py" in error
