"""Numbers of things and lengths of time in words."""


def count(number: int, what: str, plural: str = "s") -> str:
    """Return a number of things.

    >>> count(1, "seed"), count(2, "process", "es")
    ('1 seed', '2 processes')
    """
    return f"{number} {what}{'' if number == 1 else plural}"


def duration(seconds: float) -> str:
    """Return a time in its two largest units.

    Examples
    --------
    >>> duration(8.4), duration(600), duration(8000), duration(200_000)
    ('8 s', '10 min', '2 h 13 min', '2 d 7 h')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    if minutes < 60:
        return f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    if hours < 24:
        return f"{hours} h {minutes} min"
    return f"{hours // 24} d {hours % 24} h"
