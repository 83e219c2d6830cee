"""Which pairs of own and shared blocks joint actions lead to."""

import numpy as np

from ...numerics.compiling import njit


@njit(cache=True)
def pairs(tables, indices):  # type: ignore[no-untyped-def]
    """Sort joint-action indices by the blocks that they lead to.

    Parameters
    ----------
    tables
        Own blocks and their rows, shared blocks and theirs, and the divisor, as in `Blocks`.
    indices
        ``(m,)`` joint-action indices.

    Returns
    -------
    used
        ``(b,)`` rows of `own` that occur.
    slot_of, row_of
        ``(m,)`` index into `used`, and row of `shared`, of every index.
    wanted
        ``(b, R)`` which pairs occur.
    """
    own, own_rows, shared, shared_rows, divisor = tables
    n_local = len(own_rows) if len(own_rows) else len(own)
    slots, used = np.full(len(own), -1), np.empty(len(own), np.int64)
    slot_of, row_of = np.empty(len(indices), np.int32), np.empty(len(indices), np.int32)
    count = 0
    for c in range(len(indices)):
        local = indices[c] // divisor % n_local
        at = own_rows[local] if len(own_rows) else local
        if slots[at] < 0:
            slots[at] = count
            used[count] = at
            count += 1
        slot_of[c] = slots[at]
        row_of[c] = shared_rows[indices[c]] if len(shared_rows) else indices[c]
    wanted = np.zeros((count, len(shared)), np.bool_)
    for c in range(len(indices)):
        wanted[slot_of[c], row_of[c]] = True
    return used[:count], slot_of, row_of, wanted
