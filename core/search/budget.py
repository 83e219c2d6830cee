"""Budget of a decision: the number of joint actions that a team may try.

The budget is divided equally over the agents that decide. No agent receives more than its search
can use; what it does not use is divided equally over the others. The agents at the bottom of a
hierarchy therefore leave more to those that search over many others.
"""

from collections.abc import Sequence


def divide(budget: int, needs: Sequence[int]) -> list[int]:
    """Return the number of joint actions that each agent may try; the sum is within the budget.

    Parameters
    ----------
    budget
        Joint actions that the team may try in a decision.
    needs
        Joint actions that each agent would try without a budget.

    Examples
    --------
    The last agent of a chain needs 4 joint actions; the others share the remaining 60.

    >>> divide(64, [64, 16, 4]), divide(64, [64, 64, 4])
    ([44, 16, 4], [30, 30, 4])
    """
    shares = [0] * len(needs)
    by_need = sorted(range(len(needs)), key=needs.__getitem__, reverse=True)
    while by_need:
        share = budget // len(by_need)
        agent = by_need.pop()
        shares[agent] = min(needs[agent], share)
        budget -= shares[agent]
    return shares


class BudgetError(ValueError):
    """A budget is too small for any decision of a team."""


def check_budget(budget: int | None, least: int, search: str) -> None:
    """Refuse a budget below the `least` number of joint actions that a search can try.

    Raises
    ------
    BudgetError
        One line with the key, the value and the least possible budget.
    """
    if budget is not None and budget < least:
        raise BudgetError(
            f"learner.decision.budget = {budget}: {search} tries at least {least:,} joint actions "
            f"in a decision of this team, allowed: {least} or more"
        )
