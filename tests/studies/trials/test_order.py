"""Trials come out the same in any order, or it is said."""

from pathlib import Path

from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.order import fault_of_order, has_programs
from nested_agents.studies.trials.trial import trials_of

COUNTING = """
from nested_agents.scenarios.line_up import LineUp, LineUpSettings

class Counting(LineUp):
    instances = 0

    def __init__(self):
        super().__init__(LineUpSettings())
        Counting.instances += 1

    def step(self, joint_action):
        self._places = self._places + 0.01 * self.instances
        return super().step(joint_action)
"""
TABLE = {"preset": "frozen", "seeds": 1, "scenario": {"kind": "own.py:Counting"}}


def test_what_a_class_keeps_between_trials_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(COUNTING)
    trials = trials_of(Spec.of(TABLE, Sources(tmp_path)))
    assert has_programs(trials[0])
    assert fault_of_order(trials, 5) == (
        "seed 1 gives other rows when another trial has run before it: what own.py keeps in a "
        "module or class must not matter"
    )


def test_sound_trials_are_the_same_in_two_orders(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(COUNTING.replace("self.instances", "1"))
    assert fault_of_order(trials_of(Spec.of(TABLE, Sources(tmp_path))), 5) == ""
    assert not has_programs(trials_of(Spec.of({"scenario": {"kind": "line-up"}}))[0])
