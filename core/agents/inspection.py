"""Inspection of decisions: values, received messages and exploration of every agent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..hierarchy.stages import Inbox
from ..interface.agents import AnyAgents, Inspectable, RecordsValues
from ..interface.experience import AgentDecision, Decision
from ..numerics import SAME, FloatArray, IntArray
from ..plugins.words import expect


def inspect_agents(
    names: Sequence[str],
    actions: Sequence[str],
    joint_action: IntArray,
    values: Mapping[int, FloatArray],
    inboxes: Sequence[Inbox],
) -> tuple[AgentDecision, ...]:
    """Return the decision of every agent, in the order of decision; absent agents come last.

    Parameters
    ----------
    names, actions
        Names of the agents and of their actions.
    joint_action
        ``(n,)`` joint action.
    values
        Values ``(A,)`` of the actions of an agent, for the agents that have them.
    inboxes
        Messages received in every stage of the decision.
    """
    decisions = []
    for inbox in inboxes:
        payloads = inbox.payloads or (None,) * len(inbox.senders)
        for agent in inbox.agents.tolist():
            received = {}
            contents = {}
            for k in np.flatnonzero(inbox.receivers == agent).tolist():
                sender = names[inbox.senders[k]]
                received[sender] = actions[inbox.actions[k]]
                if payloads[k] is not None:
                    contents[sender] = payloads[k]
            own = values[agent].tolist() if agent in values else []
            action = int(joint_action[agent])
            greatest = max(own, default=0.0)
            tolerance = SAME * max(1.0, abs(greatest))
            decisions.append(
                AgentDecision(
                    agent=names[agent],
                    action=actions[action],
                    values=dict(zip(actions, own, strict=True)) if own else {},
                    received=received,
                    payloads=contents,
                    explored=bool(own) and own[action] < greatest - tolerance,
                )
            )
    present = {decision.agent for decision in decisions}
    for name, action in zip(names, joint_action.tolist(), strict=True):
        if name not in present:
            decisions.append(AgentDecision(name, actions[action], {}, {}, {}, False, present=False))
    return tuple(decisions)


def record_values(parts: Sequence[AnyAgents], inputs: Sequence[object]) -> None:
    """Let the parts of a team keep the values of actions in this decision."""
    for part, own in zip(parts, inputs, strict=True):
        if isinstance(part, RecordsValues):
            part.record_values(own)


def recorded_values(parts: Sequence[AnyAgents], inputs: Sequence[object]) -> dict[int, FloatArray]:
    """Return the values ``(A,)`` of the actions of every agent that has them."""
    values: dict[int, FloatArray] = {}
    for part, own in zip(parts, inputs, strict=True):
        if isinstance(part, Inspectable):
            values.update(part.action_values(own))
    return values


def explain_decision(decision: Decision) -> str:
    """Return a decision in words: per agent its action, its reason, and the messages it received.

    Raises
    ------
    ValueError
        If the team was not asked to inspect the decision.

    Examples
    --------
    >>> leader = AgentDecision("leader", "push", {"push": 0.5, "wait": 0.25}, {}, {}, False)
    >>> follower = AgentDecision(
    ...     "follower", "push", {"push": 0.0, "wait": 1.0}, {"leader": "push"}, {}, True
    ... )
    >>> print(explain_decision(Decision(np.array([0, 0]), (), (leader, follower))))
    leader takes push, the action of greatest value.
      values: push 0.5, wait 0.25
      received: nothing
    follower takes push to explore; the action of greatest value is wait.
      values: push 0, wait 1
      received: push from leader
    """
    expect("a decision of Team.act", Decision, decision=decision)
    if not decision.agents:
        raise ValueError("decision: has no details; decide with team.act(..., inspect=True)")
    return "\n".join(line for agent in decision.agents for line in _explain(agent))


def _explain(agent: AgentDecision) -> list[str]:
    if not agent.present:
        return [f"{agent.agent} is absent and decides nothing; its action is {agent.action}."]
    if not agent.values:
        reason = "."
    elif agent.explored:
        best = max(agent.values, key=agent.values.__getitem__)
        reason = f" to explore; the action of greatest value is {best}."
    else:
        reason = ", the action of greatest value."
    lines = [f"{agent.agent} takes {agent.action}{reason}"]
    if agent.values:
        values = ", ".join(f"{name} {value:.4g}" for name, value in agent.values.items())
        lines.append(f"  values: {values}")
    messages = []
    for sender, action in agent.received.items():
        payload = (
            f" with the message {agent.payloads[sender]!r}" if sender in agent.payloads else ""
        )
        messages.append(f"{action} from {sender}{payload}")
    lines.append(f"  received: {', '.join(messages) or 'nothing'}")
    return lines
