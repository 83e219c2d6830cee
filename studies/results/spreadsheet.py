"""Protection of CSV cells from being formulas of a spreadsheet."""

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Characters with which a spreadsheet's formula begins, after any spaces."""


def harmless(value: object) -> object:
    """Return a value as it may stand in a spreadsheet, a truth value as 0 or 1.

    Examples
    --------
    >>> [harmless(value) for value in ("=1+1", "@SUM(A1)", "-0.5", -0.5, "chain", None)]
    ["'=1+1", "'@SUM(A1)", '-0.5', -0.5, 'chain', None]
    """
    if isinstance(value, bool):
        return int(value)
    if not isinstance(value, str) or not value.lstrip(" \n").startswith(FORMULA):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value
