"""Max-plus: messages between agents and tables, round by round (Kok and Vlassis 2006).

Every table sends each of its agents what each action would be worth with the best of the others,
given the messages of these from other tables. On a tree the messages settle at the exact maximum;
on graphs with loops they may not, so the best joint action of all rounds is kept (anytime), and
improved by best responses, agent by agent, until none gains alone. Cost is linear in the number of
tables, whatever the width.
"""

from collections.abc import Sequence

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from ..plugins.deferred import nx
from .elimination import Scope


class MaxPlus:
    """Passes messages for a number of rounds.

    Parameters
    ----------
    scopes
        Of the tables; every agent is in one at least.
    n, n_actions
        Agents and actions.
    rounds
        Most rounds; fewer are made if the messages settle.
    damping
        Share of a message that is kept from the round before, 0 to below 1; without loops none is.

    Raises
    ------
    ValueError
        If the largest table has more than `most_entries`; before anything is allocated.

    Examples
    --------
    >>> same, other = np.eye(2), 2.0 * (1.0 - np.eye(2))
    >>> MaxPlus([(0, 1), (1, 2)], 3, 2).best([same, other + [[0, 0], [1, 0]]]).tolist()
    [1, 1, 0]
    """

    def __init__(
        self,
        scopes: Sequence[Scope],
        n: int,
        n_actions: int,
        rounds: int = 100,
        damping: float = 0.5,
        most_entries: int = 4**10,
    ) -> None:
        self.n, self.n_actions, self.rounds = n, n_actions, rounds
        # Tables over the same agents are added up: apart, they would receive their own messages.
        apart = list(dict.fromkeys(scopes))
        self._place = [apart.index(scope) for scope in scopes]
        k = max(map(len, apart))
        if n_actions**k > most_entries:
            raise ValueError(
                f"an agent with {k - 1} neighbours in the coordination graph takes a table of "
                f"{n_actions} ** {k} entries, allowed: {most_entries:,}"
            )
        # Shorter scopes are filled up with an agent that is not there, number n.
        self._members = np.array([(*scope, *[n] * (k - len(scope))) for scope in apart])
        joined = nx.Graph((("table", t), i) for t, scope in enumerate(apart) for i in scope)
        self.damping = 0.0 if nx.is_forest(joined) else damping
        self._of = [np.argwhere(self._members == i) for i in range(n)]

    def best(self, tables: Sequence[FloatArray]) -> IntArray:
        """Return the best joint action ``(n,)`` of all rounds.

        Parameters
        ----------
        tables
            One for each scope, in their order; not modified.
        """
        members, a = self._members, self.n_actions
        count, k = members.shape
        full = np.zeros((count, *[a] * k))
        for place, table in zip(self._place, tables, strict=True):
            full[place] += self._filled(table)
        to_agents = np.zeros((count, k, a))  # messages of tables
        best, greatest = np.zeros(self.n, dtype=np.int64), -np.inf
        for _ in range(self.rounds):
            sums = np.zeros((self.n + 1, a))
            np.add.at(sums, members, to_agents)
            joint = np.append(sums[:-1].argmax(axis=1), 0)
            worth = self._worth(full, joint)
            if worth > greatest:
                best, greatest = joint[:-1].copy(), worth
            to_tables = sums[members] - to_agents  # what agents heard of other tables
            to_tables[members == self.n] = 0.0
            new = self._messages(full, to_tables)
            change = np.abs(new - to_agents).max()
            to_agents = self.damping * to_agents + (1.0 - self.damping) * new
            if change < 1e-9:
                break
        return self._improved(full, best)

    def _filled(self, table: FloatArray) -> FloatArray:
        """Return a table over all axes, the same along those of agents that are not there."""
        missing = self._members.shape[1] - table.ndim
        shape = (self.n_actions,) * self._members.shape[1]
        return np.broadcast_to(table[(..., *[None] * missing)], shape)

    def _messages(self, full: FloatArray, to_tables: FloatArray) -> FloatArray:
        """Return what tables tell their agents ``(tables, k, A)``, with the mean taken away."""
        count, k, a = to_tables.shape
        total = full.copy()
        for p in range(k):
            total += to_tables[:, p].reshape(count, *(a if q == p else 1 for q in range(k)))
        new = np.empty_like(to_tables)
        for p in range(k):
            others = tuple(1 + q for q in range(k) if q != p)
            new[:, p] = total.max(axis=others) - to_tables[:, p]
        return new - new.mean(axis=2, keepdims=True)

    def _worth(self, full: FloatArray, joint: IntArray) -> float:
        """Return the sum of the tables at a joint action ``(n + 1,)``."""
        return float(full[(np.arange(len(full)), *joint[self._members].T)].sum())

    def _improved(self, full: FloatArray, best: IntArray) -> IntArray:
        """Return a joint action that no agent can improve alone."""
        joint = np.append(best, 0)
        gained = True
        while gained:
            gained = False
            for i in range(self.n):
                values = np.zeros(self.n_actions)
                for table, place in self._of[i]:
                    index: list[int | slice] = list(joint[self._members[table]])
                    index[place] = slice(None)
                    values += full[(table, *index)]
                if values.max() > values[joint[i]] + 1e-12 * max(1.0, abs(values.max())):
                    joint[i], gained = int(values.argmax()), True
        return joint[:-1]
