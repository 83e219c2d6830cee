"""Effects over all settings against numbers by hand, and the verdicts of equivalence."""

import numpy as np
import pytest
from made_up_results import Arrays

from nested_agents.studies.catalogue.hierarchies import analyse
from nested_agents.studies.results.statistics import Estimate
from research.studies.edges import Effect, effects, lines_of

SEEDS = 10


def made_up(success: dict[str, float], steps: dict[str, float]) -> Arrays:
    """Return hierarchies of two and four robots; of 20 episodes, so many succeed, in so long."""
    base = Arrays()
    for robots in (2, 4):
        for name, share in success.items():
            condition = f"{name}, robots={robots}"
            flags = (np.arange(20) < 20 * share).astype(int)
            base.evaluation[condition] = {
                "success": np.tile(flags, (SEEDS, 1)),
                "steps": np.where(flags, steps[name] * robots, 200.0) * np.ones((SEEDS, 1)),
            }
            base.columns[condition] = {"topology": name, "scenario.robots": robots}
            base.numbers[condition] = {
                "robots": np.full(SEEDS, float(robots)),
                "messages": np.zeros(SEEDS),
            }
            base.usage[condition] = {"decision_median": np.full(SEEDS, 0.001)}
    return base


def test_effects_are_means_over_settings() -> None:
    results = made_up({"chain": 1.0, "star": 0.75}, {"chain": 30.0, "star": 45.0}).frames()
    analysis = analyse(results)
    ((success, decisions),) = effects(results, analysis.cases, "chain").values()
    assert (success.settings, success.sample.tolist()) == (2, [-0.25] * SEEDS)
    assert float(decisions.estimate.value) == pytest.approx(1.5)
    assert decisions.p == pytest.approx(2 * 2.0 ** (1 - SEEDS))  # two tests, all signs agree
    text = " ".join(" ".join(lines_of({"star": (success, decisions)}, "chain")).split())
    assert "star (2 settings): success -0.25 [-0.25, -0.25]" in text
    assert "decisions x1.5 [1.5, 1.5], p = 0.004: different" in text


def test_who_never_succeeds_is_left_out() -> None:
    results = made_up({"chain": 1.0, "star": 0.0}, {"chain": 30.0, "star": 45.0}).frames()
    assert effects(results, analyse(results).cases, "chain") == {}


@pytest.mark.parametrize(
    ("low", "high", "p", "is_ratio", "verdict"),
    [
        (-0.04, 0.03, 0.6, False, "equal"),
        (0.01, 0.04, 0.01, False, "equal"),  # it differs, and by too little to matter
        (-0.06, 0.03, 0.2, False, "not decided"),
        (-0.09, -0.01, 0.01, False, "different"),
        (0.92, 1.09, 0.9, True, "equal"),
        (0.90, 1.02, 0.2, True, "not decided"),
        (1.2, 1.4, 0.001, True, "different"),
    ],
)
def test_verdicts(low: float, high: float, p: float, is_ratio: bool, verdict: str) -> None:
    estimate = Estimate(*map(np.asarray, ((low + high) / 2, low, high)))
    assert Effect("star", 1, np.zeros(2), estimate, p, is_ratio).verdict == verdict
