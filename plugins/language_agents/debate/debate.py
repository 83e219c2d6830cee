"""A debate among agents that err.

Every agent answers one question that has two possible answers. Its draft is wrong with a given
error rate. It receives the answers of its senders, and answers what the majority of these and its
own draft say. An episode is a debate, and each step is a round. `exact` enumerates all drafts of a
few agents and returns how often the team is wrong. No model is called: replace `answer` by your own
function, see docs/tutorials/functions.md.
"""

from typing import Literal

import numpy as np

import nested_agents as na

ANSWERS = ("yes", "no")


class Debate(na.Scenario):
    """A question, drafts of its answer that may be wrong, and rounds of answers.

    An agent is paid 1 in every round in which it is right.
    """

    class Settings(na.ScenarioSettings):
        """The ``[scenario]`` table of a spec."""

        players: int = 5
        """Number of agents."""
        least_error: float = 0.1
        """Error rate of the first agent; between it and the last one rates rise evenly."""
        greatest_error: float = 0.4
        """Error rate of the last agent."""
        leader_error: float | None = None
        """Error rate of the first agent, if it is another one."""
        speaks: Literal["most", "last", "all"] = "most"
        """Whose answer is the team's: that of most, of the last agent, or of all: then the team is
        wrong as soon as one of them is."""

    measures = (
        na.Measure("success", "right", source="is_right", better="higher", is_rate=True),
        na.Measure("wrong", "agents that are wrong", better="lower", least=0.0, greatest=1.0),
        na.Measure("amplification", "error over one agent's", better="lower", least=0.0),
    )

    def __init__(self, settings=Settings()):  # noqa: B008 - frozen
        n = settings.players
        self.agents = tuple(f"agent{i + 1}" for i in range(n))
        self.roles = ("agent",) * n
        self.action_set = na.ActionSet(ANSWERS, (0.0, 0.0), (0.0, 0.0), neutral=0)
        draft = na.Variable("draft", "1", 0, 1, centers=(0.0, 1.0), labels=ANSWERS)
        self.state_space = na.StateSpace("debate", (draft,), 1)
        self.errors = np.linspace(settings.least_error, settings.greatest_error, n)
        if settings.leader_error is not None:
            self.errors[0] = settings.leader_error
        self.speaks = settings.speaks

    def reset(self, seed, episode=0):
        """Ask a question; every agent drafts an answer."""
        self.rng = np.random.default_rng(seed)
        self.truth = int(self.rng.integers(2))
        errs = self.rng.random(len(self.agents)) < self.errors
        self.coin = bool(self.rng.random() < 0.5)
        self.drafts = np.where(errs, 1 - self.truth, self.truth).astype(float)[:, None]
        return self.drafts

    def step(self, joint_action):
        """Take in the answers of a round; the team's answer is that of the last one."""
        wrong = np.asarray(joint_action) != self.truth
        error = float(team_errors(wrong[None], self.speaks)[0])
        error = float(self.coin) if error == 0.5 else error
        info = {
            "is_right": 1.0 - error,
            "wrong": float(wrong.mean()),
            "amplification": error / float(self.errors.mean()),
        }
        return na.Transition(self.drafts, (~wrong).astype(float), False, False, info)


def team_errors(wrong, speaks):
    """Return how probably the team is wrong ``(m,)``, given which agents are ``(m, n)``."""
    if speaks == "last":
        return wrong[:, -1].astype(float)
    if speaks == "all":
        return wrong.any(axis=1).astype(float)
    share = wrong.mean(axis=1)
    return np.where(share == 0.5, 0.5, share > 0.5)  # a coin decides


def answer(observation, received, actions):
    """Return the answer of the majority, own draft included; the draft decides a tie."""
    draft = actions[int(observation["draft"])]
    answers = [draft, *(message.action for message in received.values())]
    same = answers.count(draft)
    other = actions[1 - actions.index(draft)]
    return {"action": draft if 2 * same >= len(answers) else other, "message": len(answers)}


def lead(observation, actions):
    """Return the own draft, like a leader that ignores the others."""
    return actions[int(observation["draft"])]


def exact(hierarchy, errors, speaks="most", rounds=1):
    """Return how probably a team is wrong: all drafts of its n agents are tried, 2 ** n."""
    n = len(hierarchy)
    drafts = (np.arange(2**n)[:, None] >> np.arange(n) & 1).astype(bool)  # whether they are wrong
    errors = np.asarray(errors)
    chance = np.where(drafts, errors, 1.0 - errors).prod(axis=1)
    beside = [[a + b - i for a, b in hierarchy.neighbors if i in (a, b)] for i in range(n)]
    before = None
    for _ in range(rounds):
        wrong = drafts.copy()
        for i in hierarchy.order:
            heard = [drafts[:, i], *(wrong[:, j] for j in hierarchy.senders(i))]
            heard += [] if before is None else [before[:, j] for j in beside[i]]
            votes = np.sum(heard, axis=0)
            tied = 2 * votes == len(heard)
            wrong[:, i] = np.where(tied, drafts[:, i], 2 * votes > len(heard))
        before = wrong
    return float(chance @ team_errors(wrong, speaks))
